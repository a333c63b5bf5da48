"""Client of the node rosgraph_launcher."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

import rosgraph
import rospy
from metacontrol_msgs.msg import LaunchedFunctions
from metacontrol_msgs.srv import ChangeNodes, ChangeNodesRequest, ChangeNodesResponse
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.ownership import launcher_mark
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.ros.node_messages import report_from, to_message
from rospy.exceptions import TransportException, TransportInitError

from rosgraph_manipulator.change.deployment import DeploymentError

REPEAT_PERIOD = 0.01  # s, wall

_NOT_REACHED = (TransportInitError, rosgraph.MasterError)
"""What rospy has caught when it raises a ServiceException and has sent no request: no registration, no connection."""


class LauncherClient:
    """Asks the launcher for changes, and hands on its reports."""

    def __init__(self, timeout: float, on_reports: Callable[[tuple[LauncherReport, ...]], None]) -> None:
        """Begin to follow the launcher.

        Args:
            timeout: how long to look for the launcher, s, wall.
            on_reports: is called with the launcher's reports of all functions, whenever one differs, in a thread of its
                own.
        """
        self.mark = launcher_mark(rospy.resolve_name("rosgraph_launcher"))
        """What the launcher's processes have in their environment."""
        self._timeout = timeout
        self._on_reports = on_reports
        self._change = rospy.ServiceProxy("rosgraph_launcher/change", ChangeNodes)
        self._subscriber = rospy.Subscriber("rosgraph_launcher/functions", LaunchedFunctions, self._take, queue_size=20)

    @property
    def is_connected(self) -> bool:
        """Whether a launcher is connected that publishes its reports."""
        return bool(self._subscriber.get_num_connections())

    def change(
        self,
        function: str,
        configuration: str,
        nodes: Iterable[NodeDescription],
        stop: Iterable[str],
        start: Iterable[str],
        found: Callable[[], None],
    ) -> ChangeNodesResponse:
        """Have the launcher change the nodes of a function.

        Args:
            function: its name.
            configuration: name of the configuration; empty: stop what only this function needs.
            nodes: all nodes of the configuration.
            stop: the nodes to stop.
            start: the nodes to start.
            found: is called when a launcher is there, before it is asked.

        Raises:
            DeploymentError: no launcher is there, or it refuses, or it has died.
        """
        request = ChangeNodesRequest(
            function=function,
            configuration=configuration,
            nodes=[to_message(node) for node in nodes],
            stop=list(stop),
            start=list(start),
        )
        try:
            answer = self._ask(request, found)
        except (rospy.ServiceException, rospy.ROSException, TransportException) as error:
            raise DeploymentError(f"rosgraph_launcher has failed ({error}): check that it runs") from error
        if not answer.ok:
            raise DeploymentError(answer.message)
        return answer

    def _ask(self, request: ChangeNodesRequest, found: Callable[[], None]) -> ChangeNodesResponse:
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

    def _take(self, message: LaunchedFunctions) -> None:
        self._on_reports(tuple(report_from(function) for function in message.functions))
