"""Tells the launchers which nodes of other configurations may be needed next: processes stand by for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import rospy
from node_kit.io.background import NoThreadError
from rosgraph_launcher.description import NodeDescription

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.io.launch_files import LaunchFile
from rosgraph_manipulator.ros.launcher_reports import WARN_PERIOD
from rosgraph_manipulator.ros.launchers import Launchers


class Standby:
    """Reads the launch files while there is nothing else to do, one at a time."""

    def __init__(
        self, options: ManipulatorOptions, launchers: Launchers, read: Callable[[Configuration], LaunchFile]
    ) -> None:
        """Begin without knowing any node.

        Args:
            options: has the configurations, and the drivers of repairs.
            launchers: those of all hosts.
            read: reads a launch file; raises DeploymentError where it can't be read.
        """
        self._launch_file = read
        self._unread = [*options.configurations.values(), *options.drivers.values()]
        self._launchers = launchers
        self._nodes: dict[str, NodeDescription] = {}
        self._is_told = True

    def changed(self) -> None:
        """Note that a change was made: a launcher that was started anew knows nothing."""
        self._is_told = False

    def look(self) -> None:
        """Take the next step: read a launch file, or tell the launchers."""
        if self._unread:
            self._read()
            self._is_told = False
        elif not self._is_told:
            try:
                self._launchers.stand_by(self._nodes.values())
                self._is_told = True
            except NoThreadError as error:
                rospy.logwarn_throttle(WARN_PERIOD, f"no processes stand by for the next change: {error}")

    def _read(self) -> None:
        try:
            system = self._launch_file(self._unread.pop(0)).system
        except DeploymentError:
            return  # whoever requests it will be told
        for node in system.nodes.values():
            plain = replace(node, parameters={})  # they are on the parameter server; the process is the same
            self._nodes.setdefault(repr(plain), plain)
