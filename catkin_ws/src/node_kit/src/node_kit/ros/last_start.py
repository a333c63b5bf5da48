"""What a node began with, kept for the next process that the same roslaunch starts in its place.

A node reads its parameters once. If they are deleted or garbled later, nobody notices before it is started again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection

import rosgraph
import rospy

from node_kit.io.supervisor import find_supervisor
from node_kit.io.xml_rpc import Client
from node_kit.last_start import json_texts, kept_of, to_restore
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
        self._supervisor = find_supervisor(sys.argv)
        names = [own, *map(rospy.resolve_name, reads), self._parameter]
        with Client(rosgraph.get_master_uri(), own) as master:
            answers = master.call_all([("getParam", name) for name in names])
        values = {name: value for name, (is_set, value) in zip(names, answers) if is_set}
        self._kept_text = values.pop(self._parameter, None)
        private = values.pop(own, {})
        if isinstance(private, dict):
            values.update({f"{own}/{key}": value for key, value in private.items() if key not in writes})
        else:
            values[own] = private
        self._present = json_texts(values)

    def keep(self) -> None:
        """Keep what was found, because the node has begun with it. The master is not waited for."""
        text = json.dumps([self._supervisor, self._present], sort_keys=True)
        if self._supervisor and text != self._kept_text:
            KeptParameter(self._parameter).set(text)

    def restore(self) -> list[str]:
        """Set parameters as they were at the last start; return their names.

        Those that are missing; if none is, those that are others now, or are new. None, if the process before this one
        was started by another roslaunch: the user may have corrected a file meanwhile.

        Raises:
            CallError: the master does not answer.
        """
        kept = kept_of(self._kept_text, self._supervisor)
        if kept is None:
            return []
        names = to_restore(kept, self._present)
        with Client(rosgraph.get_master_uri(), rospy.get_name()) as master:
            for name in names:
                if name in kept:
                    master.call("setParam", name, json.loads(kept[name]))
                else:
                    master.call("deleteParam", name)
        return names
