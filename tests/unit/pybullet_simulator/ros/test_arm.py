"""The driver of an arm: its answers to goals, cancellations and calls, whatever else happens at the same time."""

import gc
import threading
from unittest.mock import Mock

import pybullet_simulator.ros.arm as module
import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from control_msgs.msg import FollowJointTrajectoryActionGoal, GripperCommandActionGoal
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.waiting import wait_for
from pybullet_simulator.messages.arms import joint_names
from simulator_msgs.msg import ArmState
from std_srvs.srv import TriggerRequest
from trajectory_msgs.msg import JointTrajectoryPoint

PRESSED = 200.0
"""N: above the limit."""


class Server(module._Server):
    """actionlib's server without topics."""

    def start(self):
        self.started = True
        self.status_pub, self.result_pub = Mock(), Mock()

    def status(self):
        return self.status_list[-1].status.status


@pytest.fixture
def node(monkeypatch):
    """The driver of a left arm that rests at 1 s."""
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(1))
    monkeypatch.setattr(rospy, "Publisher", Mock(side_effect=lambda *_, **__: Mock()))
    monkeypatch.setattr(rospy, "Subscriber", Mock())
    monkeypatch.setattr(rospy, "Service", Mock())
    monkeypatch.setattr(rospy, "get_param", lambda *_: {})
    monkeypatch.setattr(rospy, "get_name", lambda: "/left_arm")
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(module, "_Server", Server)
    node = module.ArmNode()
    tell(node, 1.0)
    yield node
    for server in (node._motions, node._grips):
        server.status_list.clear()
    del node
    gc.collect()  # the end of a goal's handle asks for the time


def tell(node, seconds, force=0.0):
    """Tell the driver that the arm is at its place at a time."""
    still = [0.0] * 7
    stamp = rospy.Time.from_sec(seconds)
    node._on_state(
        ArmState(stamp=stamp, positions=still, velocities=still, efforts=still, gripper_width=0.08, contact_force=force)
    )


def move(node, name="motion"):
    """Send the driver a motion of 0.1 s."""
    goal = FollowJointTrajectoryActionGoal(goal_id=GoalID(id=name))
    goal.goal.trajectory.joint_names = joint_names("left")
    goal.goal.trajectory.points = [
        JointTrajectoryPoint(positions=[0.0] * 7, velocities=[0.0] * 7, time_from_start=rospy.Duration.from_sec(time))
        for time in (0.0, 0.1)
    ]
    node._motions.internal_goal_callback(goal)


def grip(node):
    """Send the driver a command that closes the fingers."""
    node._grips.internal_goal_callback(GripperCommandActionGoal(goal_id=GoalID(id="grip")))


def stop(node):
    """Have the arm meet something on its way."""
    move(node)
    for seconds in (1.02, 1.04):
        tell(node, seconds, PRESSED)
    assert node._controller.is_stopped


@pytest.mark.parametrize("name", ["motion", "other"])
def test_motion_may_be_cancelled_or_replaced_just_when_it_ends(node, name):
    """The state that ends it is taken while the server gives the driver a cancellation, or the next goal."""
    move(node)
    reached = threading.Event()

    def passing(callback):
        def call(handle):
            reached.set()
            callback(handle)

        return call

    node._motions.cancel_callback = passing(node._on_cancel)
    node._motions.goal_callback = passing(node._on_motion)

    def disturb():
        if name == "motion":
            node._motions.internal_cancel_callback(GoalID(id=name))
        else:
            move(node, name)

    disturbance = threading.Thread(target=disturb, daemon=True)

    def begin(_command):
        if not disturbance.ident:
            disturbance.start()
            reached.wait(0.3)  # it gets here only where it has a lock that the end of the motion wants, too

    node._command.publish = begin
    end = threading.Thread(target=tell, args=(node, 2.0), daemon=True)
    end.start()
    wait_for(lambda: disturbance.ident and not (end.is_alive() or disturbance.is_alive()), "both have ended", 20.0)


def test_grip_is_cancelled_while_no_motion_is_under_way(node):
    grip(node)
    node._grips.internal_cancel_callback(GoalID(id="grip"))
    assert node._grips.status() == GoalStatus.PREEMPTED


def test_motion_is_cancelled_while_nothing_is_gripped(node):
    move(node)
    node._motions.internal_cancel_callback(GoalID())
    assert node._motions.status() == GoalStatus.PREEMPTED


def test_retreat_ends_with_a_clear_answer_when_no_state_comes_any_more(node, monkeypatch):
    monkeypatch.setattr(module, "_SILENCE", 0.05)
    stop(node)
    answers = []
    call = threading.Thread(target=lambda: answers.append(node._on_retreat(TriggerRequest())), daemon=True)
    call.start()
    wait_for(lambda: answers, "an answer", 20.0)
    assert not answers[0].success
    assert "nothing new comes on /simulator/left_arm/state" in answers[0].message
    assert not node._controller.is_moving  # it does not set off when states come again
    assert node._controller.is_stopped


def test_retreat_goes_on_while_states_come(node):
    stop(node)
    answers = []
    call = threading.Thread(target=lambda: answers.append(node._on_retreat(TriggerRequest())), daemon=True)
    call.start()
    wait_for(lambda: node._controller.is_moving or answers, "it begins")
    tell(node, 5.0)
    wait_for(lambda: answers, "an answer")
    assert answers[0].success


def test_motion_ends_when_the_clock_is_set_back(node):
    move(node)
    tell(node, 0.5)
    assert node._motions.status() == GoalStatus.ABORTED
    assert "the clock was set back" in node._motions.status_list[-1].status.text


@pytest.mark.parametrize(
    ("namespace", "hardware_id"), [("/", "left_arm"), ("/r2/", "robot:/r2"), ("/site/r2/", "robot:/site/r2")]
)
def test_safety_stop_says_whose_arm_it_is(node, monkeypatch, namespace, hardware_id):
    monkeypatch.setattr(rospy, "get_namespace", lambda: namespace)
    stop(node)
    (array,) = node._diagnostics.publish.call_args.args
    (status,) = array.status
    assert (status.name, status.level) == ("left_arm: safety", DiagnosticStatus.ERROR)
    assert status.hardware_id == hardware_id
