"""dynamic_reconfigure servers of move_base: part of the ROS shell, started beside `node`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import rospy
from dynamic_reconfigure.server import Server
from node_kit.ros.reconfigure_server import Strict

from move_base.parameters.reconfiguration import ServerDescription, as_default

WARN_PERIOD = 1.0
"""The same warning is repeated no sooner than this, s."""

Present = Callable[[ServerDescription, Iterable[str]], dict[str, Any]]
Take = Callable[[str, dict[str, Any]], str]


def offer(descriptions: Sequence[ServerDescription], present: Present, take: Take) -> list[Server]:
    """Start the servers.

    Args:
        descriptions: of the servers.
        present: returns what parameters have as values now.
        take: takes new values in a namespace, and returns why not, or an empty text.
    """
    return [_Server(description, present, take) for description in descriptions]


class _Server(Strict, Server):
    """A server that starts with the node's values, and writes only changed values to the parameter server.

    The base class reads and writes each parameter in a call of its own, which takes a second for six servers.
    """

    def __init__(self, description: ServerDescription, present: Present, take: Take) -> None:
        self._description = description
        self._present = present
        self._take = take
        self._written: dict[str, Any] = {}
        self._first: dict[str, Any] = {}  # the values of the start
        definition = importlib.import_module(f"move_base.cfg.{description.definition}Config")
        self._names = [str(name) for name in definition.defaults]
        super().__init__(definition, self._on_change, description.namespace)

    def _copy_from_parameter_server(self) -> None:
        present = self._present(self._description, self._names)
        self.config.update({name: as_default(value, self.config[name]) for name, value in present.items()})

    def _copy_to_parameter_server(self) -> None:
        for name in self._names:
            if self.config[name] != self._written.get(name):
                rospy.set_param(self.ns + name, self.config[name])
        self._written = {name: self.config[name] for name in self._names}

    def _on_change(self, config: Any, level: int) -> Any:
        if level == -1:  # the first call tells what there is
            self._written = {name: config[name] for name in self._names}
            self._first = dict(self._written)
            return config
        if config.get("restore_defaults"):
            config.update(self._first)
        values = {name: config[name] for name in self._names if config[name] != self._written.get(name)}
        problem = self._take(self._description.namespace, values) if values else ""
        if problem:
            rospy.logwarn_throttle_identical(WARN_PERIOD, f"Parameters refused: {problem}")
            config.update(self._written)
        return config
