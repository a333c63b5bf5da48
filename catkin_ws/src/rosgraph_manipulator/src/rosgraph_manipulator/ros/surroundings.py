"""The clock, the master and the nodes of the manipulator, on ROS."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import rospy
from geometry_msgs.msg import Twist
from node_kit.io.background import NoThreadError
from node_kit.ros.services import SERVICE_FAILURES
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import CommandLineError, command_line
from rosgraph_launcher.io.master import NodeApi, advertised

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.io import foreign_nodes
from rosgraph_manipulator.io.launch_files import LaunchFile, read_configuration
from rosgraph_manipulator.io.master import get_parameters, publishers, set_parameters

COMMAND_TIMEOUT = 5.0  # s, wall, for a `rosparam` call of a launch file
ASK_THREADS = 8  # nodes are asked side by side whether they hang


class RosLog:
    """Lines for the operator, in the node's log."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def info(self, line: str) -> None:
        """Tell what happens."""
        rospy.loginfo("%s", line)

    def warn(self, line: str, once: bool = False) -> None:
        """Tell what may go wrong; the same line only once, where `once` is set."""
        if not once:
            rospy.logwarn("%s", line)
        elif line not in self._told:
            self._told.add(line)
            rospy.logwarn("%s", line)

    def error(self, line: str) -> None:
        """Tell what has failed."""
        rospy.logerr("%s", line)


class RosSurroundings:
    """The `Surroundings` of a manipulator on ROS."""

    failures: tuple[type[Exception], ...] = SERVICE_FAILURES

    def __init__(self) -> None:
        self.log = RosLog()
        self._news = threading.Condition()
        self._cmd_vel = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._parameter_files: dict[str, str] = {}

    @property
    def is_ending(self) -> bool:
        """Whether the node was asked to end."""
        return bool(rospy.is_shutdown())

    def now(self) -> float:
        """Return the time, monotonic wall s."""
        return time.monotonic()

    def pause(self, duration: float) -> None:
        """Let so many s pass."""
        time.sleep(duration)

    @contextmanager
    def news(self) -> Iterator[None]:
        """Enclose taking in a report; those that wait for news look again after it."""
        with self._news:
            yield
            self._news.notify_all()

    def wait_for_news(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition on the reports is true, so many s at most; return whether it is."""
        with self._news:
            return self._news.wait_for(condition, timeout)

    def resolve(self, name: str) -> str:
        """Return the full name of a node, topic or parameter."""
        return str(rospy.resolve_name(name))

    def publishers(self, topic: str) -> set[str]:
        """Return the nodes that publish a topic."""
        return publishers(topic)

    def drivers(self) -> set[str]:
        """Return the other nodes that command the base."""
        return publishers(self._cmd_vel.resolved_name) - {rospy.get_name()}

    def halt(self) -> None:
        """Command the base to stand still."""
        self._cmd_vel.publish(Twist())

    def advertised(self, nodes: Collection[str]) -> set[str]:
        """Return the topics and services that nodes offer."""
        return advertised(nodes)

    def parameters(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters, by full name; those that are not set are left out."""
        return get_parameters(names)

    def set_parameters(self, values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
        """Delete parameters, then set others, by full name."""
        set_parameters(values, delete)

    def run(self, command: Sequence[str]) -> None:
        """Run a `rosparam` command of a launch file.

        Raises:
            DeploymentError: it fails.
        """
        try:
            subprocess.run(["/usr/bin/env", *command], check=True, timeout=COMMAND_TIMEOUT, stdout=subprocess.DEVNULL)
        except (OSError, subprocess.SubprocessError) as error:
            raise DeploymentError(" ".join(str(error).split())) from error

    def silent(self, nodes: Collection[str]) -> set[str]:
        """Return the nodes that do not answer, though their processes run.

        Raises:
            NoThreadError: they can't be asked now.
        """
        if not nodes:
            return set()
        with ThreadPoolExecutor(ASK_THREADS, thread_name_prefix="ask whether it hangs") as pool:
            try:
                asked = {node: pool.submit(NodeApi.is_answering, node) for node in nodes}
            except RuntimeError as error:
                raise NoThreadError(error) from error
        return {node for node, answer in asked.items() if not answer.result()}

    def shut_down(self, node: str, reason: str) -> bool:
        """Ask a node to end; return whether it has answered."""
        return NodeApi.request_shutdown(node, reason)

    def is_answering(self, node: str) -> bool:
        """Tell whether a node answers."""
        return NodeApi.is_answering(node)

    def end_node(self, node: str) -> None:
        """End a node that somebody else has started.

        Raises:
            DeploymentError: it stays.
        """
        foreign_nodes.end_node(node)

    def launch_file(self, configuration: Configuration) -> LaunchFile:
        """Read the launch file of a configuration.

        Raises:
            DeploymentError: it can't be read.
        """
        return read_configuration(configuration, self._parameter_files)

    def why_not_started(self, node: NodeDescription) -> str:
        """Return why a node of this host can't be started, such as an executable that is missing; empty: it can."""
        try:
            command_line(node)
        except CommandLineError as error:
            return str(error)
        return ""
