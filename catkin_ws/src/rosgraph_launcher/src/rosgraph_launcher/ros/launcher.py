"""Node rosgraph_launcher: offers the launcher as a service, and publishes its reports."""

from __future__ import annotations

import contextlib
import math
import os
import select
import threading
import time

import rospy
from metacontrol_msgs.msg import LaunchedFunctions, Phase
from metacontrol_msgs.srv import (
    ChangeNodes,
    ChangeNodesRequest,
    ChangeNodesResponse,
    CheckNodes,
    CheckNodesRequest,
    CheckNodesResponse,
    ReadUsage,
    ReadUsageRequest,
    ReadUsageResponse,
    StandBy,
    StandByRequest,
    StandByResponse,
)
from node_kit.io.inbox import ClosedError, Inbox
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import LONGEST_END, Lifetime
from node_kit.ros.parts import watch_parts

from rosgraph_launcher.io.launcher import Launcher
from rosgraph_launcher.io.ownership import launcher_mark
from rosgraph_launcher.io.processes import StartError, check_host
from rosgraph_launcher.io.secret import SecretError, check_signature, read_secret
from rosgraph_launcher.io.this_host import addresses
from rosgraph_launcher.io.usage import read_samples
from rosgraph_launcher.launching.options import LONGEST_TIMEOUT, LauncherOptions
from rosgraph_launcher.launching.report import ENDING, LauncherReport
from rosgraph_launcher.launching.restarts import RestartPolicy
from rosgraph_launcher.launching.supervision import LauncherError
from rosgraph_launcher.ros.node_messages import from_message, report_message, usage_messages

TOPIC = "rosgraph_launcher/functions"
"""The launchers of all hosts share it, whatever their names are, so that all are found there."""

LOOK_PERIOD = 0.2  # s, wall, after which the main thread sees at the latest that the node must end


class LauncherNode:
    """The service and the topic of the launcher. Only the service callbacks run outside the main thread."""

    def __init__(self, options: LauncherOptions, life: Lifetime) -> None:
        self._inbox = Inbox(self._wake)
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_write, False)
        self._ends = ""
        self._closed = threading.Event()
        self._life = life
        life.consequence = "its nodes are stopped, and it ends"
        # Twice: first for a change that is under way, then for the stop of all nodes.
        self._longest_end = LONGEST_END + 2 * (options.shutdown_timeout + options.sigint_timeout)
        self._functions = rospy.Publisher(TOPIC, LaunchedFunctions, queue_size=10, latch=True)
        self._launcher = Launcher(options, self._publish, rospy.logwarn)
        self._services = (
            rospy.Service("~change", ChangeNodes, self._on_change),
            rospy.Service("~check", CheckNodes, self._on_check),
            rospy.Service("~usage", ReadUsage, self._on_usage),
            rospy.Service("~stand_by", StandBy, self._on_stand_by),
        )

    def end(self, reason: str) -> None:
        """Tell the main thread to stop the nodes and then to end this node."""
        self._life.cut_off(self._longest_end)
        self._ends = self._ends or reason
        self._inbox.close(ENDING)
        self._wake()

    def _end_on_request(self) -> None:
        self.end("it was asked to end")
        if threading.current_thread() is not threading.main_thread():
            self._closed.wait()  # before the process ends

    def spin(self) -> None:
        """Serve requests and look after the nodes until this node must end; then stop all nodes."""
        # Not before: there was nothing to stop yet, and rospy may hang while it registers.
        self._life.longest_end, self._life.on_end = self._longest_end, self.end
        rospy.on_shutdown(self._end_on_request)
        while not self._ends:
            self._wait()
            self._inbox.do_next()
            self._launcher.look_after()
            if not self._inbox:
                self._launcher.stand_by()
        self._launcher.close(gently=not self._life.watch.lost)
        self._closed.set()

    def _wait(self) -> None:
        due = self._launcher.next_restart()
        timeout = LOOK_PERIOD if due is None else min(LOOK_PERIOD, max(0.0, due - time.monotonic()))
        poll = select.poll()
        poll.register(self._wake_read, select.POLLIN)
        for descriptor in self._launcher.pidfds():
            poll.register(descriptor, select.POLLIN)
        for descriptor, _ in poll.poll(math.ceil(1000.0 * timeout)):
            if descriptor == self._wake_read:
                os.read(self._wake_read, 4096)

    def _wake(self) -> None:
        with contextlib.suppress(BlockingIOError):  # the pipe is full, so the main thread wakes up anyway
            os.write(self._wake_write, b"\0")

    def _on_change(self, request: ChangeNodesRequest) -> ChangeNodesResponse:
        try:
            return self._inbox.call(lambda: self._change(request))
        except ClosedError as error:
            raise rospy.ServiceException(str(error)) from error

    def _on_check(self, request: CheckNodesRequest) -> CheckNodesResponse:
        up = [self._launcher.is_up(name) for name in request.nodes]
        conflicts = ["" if is_up else self._launcher.conflict(name) for name, is_up in zip(request.nodes, up)]
        return CheckNodesResponse(up=up, conflicts=conflicts)

    def _on_usage(self, request: ReadUsageRequest) -> ReadUsageResponse:
        return ReadUsageResponse(usage_messages(read_samples(request.pids, request.alone)))

    def _on_stand_by(self, request: StandByRequest) -> StandByResponse:
        try:
            check_signature(request, rospy.get_name())
            nodes = [from_message(node) for node in request.nodes]
            self._inbox.call(lambda: self._launcher.expect(nodes))
        except (ClosedError, SecretError, ValueError) as error:
            raise rospy.ServiceException(str(error)) from error
        return StandByResponse()

    def _change(self, request: ChangeNodesRequest) -> ChangeNodesResponse:
        try:
            check_signature(request, rospy.get_name())
            nodes = {node.name: from_message(node) for node in request.nodes}
            phases = self._launcher.change(request.function, request.configuration, nodes, request.stop, request.start)
        except (LauncherError, SecretError, ValueError) as error:
            return ChangeNodesResponse(ok=False, message=str(error), change=self._launcher.changes)
        return ChangeNodesResponse(
            ok=True, change=self._launcher.changes, phases=[Phase(*phase) for phase in phases.items()]
        )

    def _publish(self, reports: tuple[LauncherReport, ...]) -> None:
        message = LaunchedFunctions(functions=[report_message(report) for report in reports])
        message.header.stamp = rospy.Time.now()
        self._functions.publish(message)


PARAMETERS = (
    "addresses",
    "host",
    "restart_delay",
    "restart_intensity",
    "restart_period",
    "shutdown_timeout",
    "sigint_timeout",
    "standby",
    "standby_others",
)
"""Names of all parameters; `~addresses` is set by the node itself."""


def read_options() -> LauncherOptions:
    """Read the node's parameters.

    Raises:
        ParameterError: one can't be used.
    """
    parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
    for line in parameters.strangers(PARAMETERS):
        rospy.logwarn("%s", line)
    default, policy = LauncherOptions(mark=""), RestartPolicy()
    return LauncherOptions(
        mark=launcher_mark(rospy.get_name()),
        run_id=str(rospy.get_param("/run_id", "")),
        shutdown_timeout=parameters.number("shutdown_timeout", default.shutdown_timeout, low=0.0, high=LONGEST_TIMEOUT),
        sigint_timeout=parameters.number("sigint_timeout", default.sigint_timeout, low=0.0, high=LONGEST_TIMEOUT),
        standby=parameters.flag("standby", default.standby),
        standby_others=parameters.whole("standby_others", default.standby_others, low=0),
        policy=RestartPolicy(
            intensity=int(parameters.number("restart_intensity", policy.intensity, low=0)),
            period=parameters.number("restart_period", policy.period, low=0.1),
            first_delay=parameters.number("restart_delay", policy.first_delay, low=0.0),
        ),
    )


def main() -> None:
    """Run the node; exit status 2 when it can't start."""
    with Lifetime("rosgraph_launcher", ParameterError, SecretError, StartError) as life:
        check_host()
        read_secret()
        life.start(writes=("addresses",))
        options = read_options()
        rospy.set_param("~addresses", addresses(str(rospy.get_param("~host", ""))))
        node = LauncherNode(options, life)
        life.begun()
        watch_parts("launcher")
        node.spin()
