"""What a robot has for a node that decides: a monitor's diagnostics, and a manipulator."""

import actionlib
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_bags import ownership
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    FunctionGrounding,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
)

from helpers.connections import reaches
from helpers.waiting import wait_for


def status(message, *values, level=0, name=""):
    """Return a status with pairs of key and value."""
    return DiagnosticStatus(level=level, name=name, message=message, values=[KeyValue(*pair) for pair in values])


class Diagnostics:
    """Publishes statuses on /diagnostics, or on the topic that takes its place.

    Attributes:
        robot: namespace of the robot of which they are; empty: the statuses do not say.
    """

    def __init__(self, topic="/diagnostics"):
        self.robot = "/"
        self._publisher = rospy.Publisher(topic, DiagnosticArray, queue_size=50)

    def reaches(self, node):
        """Tell whether a node is connected to it."""
        return reaches(self._publisher, node)

    def tell(self, *statuses, stamp=None):
        """Publish statuses in one array, and return its stamp."""
        for item in statuses:
            item.hardware_id = item.hardware_id or (self.robot and ownership.hardware_id_of(self.robot))
        array = DiagnosticArray(status=list(statuses))
        array.header.stamp = stamp or rospy.Time.now()
        self._publisher.publish(array)
        return array.header.stamp

    def component(self, name, value):
        """Publish the status of a component."""
        return self.tell(status("Component status", (name, value), name=name, level=2 if value == "FALSE" else 0))


class Manipulator:
    """Deploys in no time: announces, and answers.

    Attributes:
        failures: results of the next requests; None: it does not answer. It carries out all others.
    """

    def __init__(self, namespace="", serves=True, function="f_move"):
        self.failures = []
        self.requests = []
        self.running = ""
        self._namespace, self._function = namespace, function
        self._active = rospy.Publisher(
            f"{namespace}/rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=5, latch=True
        )
        if serves:
            self.serve()

    def serve(self):
        """Offer the action from now on."""
        name = f"{self._namespace}/rosgraph_manipulator_action_server"
        self._server = actionlib.SimpleActionServer(name, MvpReconfigurationAction, self._execute, auto_start=False)
        self._server.start()

    @property
    def is_known(self):
        """Whether a client has found the action, on each of its topics."""
        server = self._server.action_server
        ends = (server.goal_sub, server.cancel_sub, server.status_pub, server.feedback_pub, server.result_pub)
        return all(end.get_num_connections() for end in ends)

    def announce(self, configuration, state="STABLE"):
        """Say what runs."""
        self.running = configuration
        grounding = FunctionGrounding(self._function, configuration, state)
        self._active.publish(ActiveConfiguration(functions=[grounding]))

    def _execute(self, goal):
        name = goal.desired_configuration_name
        result = self.failures.pop(0) if self.failures else 1
        self.requests.append(name)
        if result is None:
            wait_for(self._server.is_preempt_requested, "a request to give up")
            self._server.set_preempted()
        elif result == 1:
            self.announce(name, "RECONFIGURING")
            self.announce(name)
            self._server.set_succeeded(MvpReconfigurationResult(1))
        else:
            self._server.set_aborted(MvpReconfigurationResult(result), "it did not come up")
