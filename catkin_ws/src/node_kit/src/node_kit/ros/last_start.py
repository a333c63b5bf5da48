"""What a node began with, kept for the next process that the same roslaunch starts in its place.

A node reads its parameters once. If they are deleted or garbled later, nobody notices before it is started again.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Mapping
from typing import Any

import rosgraph
import rospy

from node_kit.io.supervisor import find_supervisor
from node_kit.io.xml_rpc import Client
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
        self._present = {**_texts({own: private} if not isinstance(private, dict) else {}), **_texts(values)}
        if isinstance(private, dict):
            self._present |= _texts({f"{own}/{key}": value for key, value in private.items() if key not in writes})

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


def kept_of(text: Any, supervisor: str) -> dict[str, str] | None:
    """Return the parameters, name -> value as JSON, that a process of the same supervisor has kept; None: none has.

    Args:
        text: the value of the parameter in which they are kept; whatever it is.
        supervisor: of this process; empty: it has none, and nothing is kept.
    """
    try:
        by, kept = json.loads(text)
        for value in kept.values():
            json.loads(value)
    except (AttributeError, RecursionError, TypeError, ValueError):
        return None
    return dict(kept) if supervisor and by == supervisor else None


def to_restore(kept: Mapping[str, str], present: Mapping[str, str]) -> list[str]:
    """Return which parameters are to be set or deleted, by what was kept and by what is found now."""
    missing = sorted(kept.keys() - present.keys())
    return missing or sorted(name for name in {*kept, *present} if kept.get(name) != present.get(name))


def _texts(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as JSON; without those that JSON can't tell, such as dates."""
    texts = {}
    for name, value in values.items():
        try:
            texts[name] = json.dumps(value, sort_keys=True)
        except (TypeError, ValueError, RecursionError):
            continue
    return texts
