"""Client of the node rosgraph_launcher."""

from __future__ import annotations

import time
from collections.abc import Callable

import rosgraph
import rospy
from metacontrol_msgs.msg import LauncherState
from metacontrol_msgs.srv import ChangeConfiguration, ChangeConfigurationRequest, ChangeConfigurationResponse
from rospy.exceptions import TransportException, TransportInitError

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.launching.report import LauncherReport

REPEAT_PERIOD = 0.01  # s, wall

_NOT_REACHED = (TransportInitError, rosgraph.MasterError)
"""What rospy has caught when it raises a ServiceException and has sent no request: no registration, no connection."""


class LauncherClient:
    """Asks the launcher for changes, and hands on its reports."""

    def __init__(self, timeout: float, on_report: Callable[[LauncherReport], None]) -> None:
        """Begin to follow the launcher.

        Args:
            timeout: how long to look for the launcher, s, wall.
            on_report: is called with each report of the launcher, in a thread of its own.
        """
        self._timeout = timeout
        self._on_report = on_report
        self._change = rospy.ServiceProxy("rosgraph_launcher/change", ChangeConfiguration)
        self._subscriber = rospy.Subscriber("rosgraph_launcher/state", LauncherState, self._take, queue_size=20)

    def change(
        self, wanted: Configuration | None, start: tuple[str, ...], found: Callable[[], None]
    ) -> ChangeConfigurationResponse:
        """Have the launcher change to a configuration.

        Args:
            wanted: the configuration; None: stop everything.
            start: the nodes to start.
            found: is called when a launcher is there, before it is asked.

        Raises:
            DeploymentError: no launcher is there, or it refuses, or it has died.
        """
        request = ChangeConfigurationRequest(
            configuration=wanted.name if wanted else "",
            launch_file=wanted.launch_file if wanted else "",
            args=list(wanted.args) if wanted else [],
            start=list(start),
        )
        try:
            answer = self._ask(request, found)
        except (rospy.ServiceException, rospy.ROSException, TransportException) as error:
            raise DeploymentError(f"rosgraph_launcher has failed ({error}): check that it runs") from error
        if not answer.ok:
            raise DeploymentError(answer.message)
        return answer

    def _ask(self, request: ChangeConfigurationRequest, found: Callable[[], None]) -> ChangeConfigurationResponse:
        """Return the launcher's answer to a request, which is made as soon as a launcher is there.

        A launcher that is being killed may accept the connection by which `wait_for_service` finds it and refuse the
        next one, because the kernel closes its sockets one after the other. A request that reached no launcher is
        repeated. One that did is not, because a part of it may be done.
        """
        deadline = time.monotonic() + self._timeout
        while True:
            self._change.wait_for_service(max(deadline - time.monotonic(), REPEAT_PERIOD))
            found()
            try:
                return self._change(request)
            except rospy.ServiceException as error:
                if not isinstance(error.__context__, _NOT_REACHED) or time.monotonic() > deadline:
                    raise
                time.sleep(REPEAT_PERIOD)

    def _take(self, state: LauncherState) -> None:
        self._on_report(report_from(state))


def report_from(state: LauncherState) -> LauncherReport:
    """Return the content of the launcher's message."""
    return LauncherReport(
        state.configuration, state.change, state.state, tuple(state.nodes), tuple(state.dead), state.message
    )
