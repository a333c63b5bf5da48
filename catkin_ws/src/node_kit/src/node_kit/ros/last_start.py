"""What a node began with, kept for the next process that the same roslaunch starts in its place.

A node reads its parameters once. If they are deleted or garbled later, nobody notices before it is started again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Mapping

import rosgraph
import rospy

from node_kit.io.supervisor import find_supervisor
from node_kit.io.xml_rpc import Client
from node_kit.last_start import NO_JSON, Kept, json_texts, kept_of, missing, remedy
from node_kit.ros.kept_parameter import KeptParameter

GROUP = "/node_kit/began_with"
"""The group of the parameters with what nodes began with. It is none of the nodes' own, which may be deleted whole."""


class LastStart:
    """What a node finds at its start, and what the process before it had begun with. rospy must have begun."""

    def __init__(self, writes: Collection[str] = (), reads: Collection[str] = ()) -> None:
        """Read both.

        Args:
            writes: the node's private parameters that it sets itself, which are left as they are.
            reads: parameters that it reads beside its private ones.

        Raises:
            CallError: the master does not answer.
        """
        own = rospy.get_name()
        self._parameter = f"{GROUP}/{own.strip('/').replace('/', '__')}"
        self._writes, self._reads = frozenset(writes), [rospy.resolve_name(name) for name in reads]
        supervisor = find_supervisor(sys.argv)
        self._by = f"{own} of {supervisor}" if supervisor else ""
        self._present, self._kept_text = self._read()
        self._kept = kept_of(self._kept_text, self._by)

    def complete(self) -> list[str]:
        """Set what the last process had begun with and is not there any more; return the names.

        Raises:
            CallError: the master does not answer.
        """
        lacking = missing(self._kept, self._present)
        if lacking:
            self._set(lacking)
            self._present, _ = self._read()
        return sorted(lacking)

    def keep(self) -> None:
        """Keep what was found, because the node has begun with it. The master is not waited for.

        Raises:
            RuntimeError: there is no thread to be had.
        """
        values = {name: text for name, text in self._present.items() if text != NO_JSON}
        text = Kept(self._by, values).to_text()
        if self._by and text != self._kept_text:
            KeptParameter(self._parameter).set(text)

    def mend(self) -> tuple[list[str], bool]:
        """Do what may help a node that can't begin; return the parameters that were set, and whether it begins again.

        They are set as they were at the last start, or, where that did not help, as they were found before. Nothing is,
        if the process before this one was started by another roslaunch: the user may have corrected a file meanwhile.

        Raises:
            CallError: the master does not answer.
        """
        if not self._by:
            return [], False
        if self._read()[0] != self._present:  # somebody mends it just now
            return [], True
        what = remedy(self._kept, self._present, self._by)
        self._set(what.wanted)
        if what.kept is not None:
            with Client(rosgraph.get_master_uri(), rospy.get_name()) as master:
                master.call("setParam", self._parameter, what.kept.to_text())
        return sorted(what.wanted), what.again

    def _read(self) -> tuple[dict[str, str], object]:
        """Return what there is now, name -> JSON, and what was kept."""
        own = rospy.get_name()
        names = [own, *self._reads, self._parameter]
        with Client(rosgraph.get_master_uri(), own) as master:
            answers = master.call_all([("getParam", name) for name in names])
        values = {name: value for name, (is_set, value) in zip(names, answers) if is_set}
        kept = values.pop(self._parameter, None)
        private = values.pop(own, {})
        if isinstance(private, dict):
            values.update({f"{own}/{key}": value for key, value in private.items() if key not in self._writes})
        else:
            values[own] = private
        return json_texts(values), kept

    def _set(self, values: Mapping[str, str | None]) -> None:
        """Set parameters, name -> JSON, and delete others: None."""
        with Client(rosgraph.get_master_uri(), rospy.get_name()) as master:
            for name, text in sorted(values.items()):
                if text is None:
                    master.call("deleteParam", name)
                else:
                    master.call("setParam", name, json.loads(text))
