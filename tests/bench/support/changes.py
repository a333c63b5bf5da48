"""Changes of D2's configuration, measured on the whole running system, at real-time factor 1."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import re
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from helpers.ports import free_port
from metacontrol_experiments.io.processes import ProcessTree, wait_until
from metacontrol_msgs.msg import ActiveConfiguration, MvpReconfigurationAction, MvpReconfigurationGoal
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from support.figures import entry, percentile

DEADLINE_S = 60.0
PAPER_S = 4.3  # mean time of a reconfiguration in the paper
PAPER = "published system (paper, another machine)"
GOALS = (5.4, 6.0), (-8.0, -8.0)  # of a long way to and fro
SERVER, STATUS = "/move_base", "/move_base/status"
NEAR_M = 5.0  # so near to its goal a robot is sent to the other one: the goal is not reached meanwhile
UNDER_WAY_M = 1.0  # so much nearer to its goal than at first a robot no longer turns round


@dataclass
class Change:
    """One change, times in s, wall.

    Attributes:
        accepted: from the request to the navigation goal being at work in the server that will pursue it.
        result: from the request to the manipulator's result.
        tactic: by which it was made.
        phases: as the manipulator tells them.
        began: when it was asked for, s since the epoch.
        parts: consecutive parts of `accepted`, by the master's log; none where the server was not restarted.
        slowest: least speed of the robot from the request to the result, m/s.
    """

    accepted: float
    result: float
    tactic: str
    phases: dict[str, float] = field(default_factory=dict)
    slowest: float = 0.0
    began: float = 0.0
    parts: dict[str, float] = field(default_factory=dict)


class System:
    """D2 without the reasoner, with a navigation goal under way."""

    def __init__(self) -> None:
        self.navigation = actionlib.ActionClient("move_base", MoveBaseAction)
        self._manipulator = actionlib.SimpleActionClient("rosgraph_manipulator_action_server", MvpReconfigurationAction)
        self._condition = threading.Condition()
        self._active: tuple[str, object, float] = ("", None, 0.0)  # goal, server's connection, time
        self._configuration = ActiveConfiguration()
        self._speed = 0.0
        self._slowest = 0.0
        rospy.Subscriber("move_base/status", GoalStatusArray, self._on_status)
        rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, self._on_configuration)
        self._position = math.nan, math.nan
        rospy.Subscriber("odom", Odometry, self._on_odometry)
        rospy.Subscriber("ground_truth/state", Odometry, self._on_state)
        self._stop = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        if not self._manipulator.wait_for_server(rospy.Duration(DEADLINE_S)):
            raise RuntimeError("the manipulator did not come up")
        if not wait_until(lambda: self._configuration.functions, DEADLINE_S):
            raise RuntimeError("no configuration was deployed")
        if not self.navigation.wait_for_server(rospy.Duration(DEADLINE_S)):
            raise RuntimeError("navigation did not come up")
        if not wait_until(lambda: not math.isnan(self._position[0]), DEADLINE_S):
            raise RuntimeError("the robot's place did not come")
        self._goals = itertools.cycle(GOALS)
        self._handles: list[actionlib.ClientGoalHandle] = []  # actionlib forgets a goal whose handle is gone
        self.set_off()

    def change(self, name: str) -> Change:
        """Have a configuration deployed, and wait until the goal is at work in it and the robot moves."""
        with self._condition:
            server, self._slowest = self._active[1], self._speed
        began, began_at = time.monotonic(), time.time()
        self._manipulator.send_goal(MvpReconfigurationGoal(name))
        if not self._manipulator.wait_for_result(rospy.Duration(DEADLINE_S)):
            raise RuntimeError(f"no result for {name} within {DEADLINE_S:g} s")
        finished = time.monotonic()
        if self._manipulator.get_result().result != 1:
            raise RuntimeError(f"{name}: {self._manipulator.get_goal_status_text()}")
        with self._condition:
            slowest = self._slowest
            deployed = self._condition.wait_for(
                lambda: self._configuration.message and self._configuration.functions[0].configuration == name,
                DEADLINE_S,
            )
            tactic = self._configuration.tactic
            replaced = tactic in ("restart", "replace")
            found = self._condition.wait_for(
                lambda: self._active[0] == self.goal_id and (not replaced or self._active[1] is not server), DEADLINE_S
            )
            if not (found and deployed):
                raise RuntimeError(f"{name}: the navigation goal was lost")
            accepted = self._active[2] if replaced else finished
            phases = {phase.name: phase.duration for phase in self._configuration.phases}
        return Change(accepted - began, finished - began, tactic, phases, slowest, began_at)

    def drives(self) -> bool:
        """Wait until the robot drives towards its goal: turning round, it stands for a moment whatever is changed."""
        return bool(wait_until(lambda: self._speed > 0.1 and self.distance() < self._far - UNDER_WAY_M, DEADLINE_S))

    def distance(self) -> float:
        """Return the distance from the goal as the crow flies, m."""
        return math.dist(self._position, self._goal)

    def set_off(self) -> None:
        """Send the next navigation goal, in place of the former one, and wait until it is at work."""
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = "map"
        self._goal = next(self._goals)
        goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = self._goal
        goal.target_pose.pose.orientation.w = 1.0
        self._handles.append(self.navigation.send_goal(goal))
        self.goal_id = str(self._handles[-1].comm_state_machine.action_goal.goal_id.id)
        if not wait_until(lambda: self._active[0] == self.goal_id, DEADLINE_S):
            raise RuntimeError("the navigation goal was not accepted")
        self._far = self.distance()

    def _on_status(self, message: GoalStatusArray) -> None:
        connection = message._connection_header  # one object per connection, so another one is another server
        with self._condition:
            for entry in message.status_list:
                known = self._active[0] == entry.goal_id.id and self._active[1] is connection
                if entry.status == GoalStatus.ACTIVE and not known:
                    self._active = (entry.goal_id.id, connection, time.monotonic())
            self._condition.notify_all()

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        with self._condition:
            self._configuration = message
            self._condition.notify_all()

    def _on_odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        with self._condition:
            self._speed = abs(twist.linear.x) + abs(twist.linear.y)
            self._slowest = min(self._slowest, self._speed)

    def _on_state(self, message: Odometry) -> None:
        position = message.pose.pose.position
        self._position = position.x, position.y


_PARTS = (
    ("end", "-", STATUS),  # the old server has said goodbye
    ("imports", "+", "/rosout"),  # the new one registers: rospy's first topic
    ("construction", "+", STATUS),
)
_REGISTRATION = re.compile(r"(\d+-\d+-\d+ \d+:\d+:\d+),(\d+): ([+-])PUB \[(\S+)\] (\S+) ")


def _parts(changes: list[Change], logs: Path) -> None:
    """Fill in the parts of changes that have restarted the navigation server, by the master's log."""
    events = [
        (time.mktime(time.strptime(second, "%Y-%m-%d %H:%M:%S")) + int(ms) / 1000.0, sign, topic)
        for path in logs.glob("*/master.log")
        for second, ms, sign, topic, node in _REGISTRATION.findall(path.read_text())
        if node == SERVER
    ]
    for change in changes:
        now = change.began
        later = [event for event in events if now <= event[0] < now + DEADLINE_S]
        for name, sign, topic in _PARTS:
            found = [stamp for stamp, *what in later if what == [sign, topic]]
            if not found:
                break
            change.parts[name], now = found[0] - now, found[0]
        else:
            change.parts["connection"] = change.began + change.accepted - now


@contextlib.contextmanager
def running_system(logs: Path, profile: str, parameters: dict[str, Any] | None = None) -> Iterator[System]:
    """Start D2 in a configuration, with parameters set before and logs in a folder; end it."""
    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    folder = str(logs)
    tree = ProcessTree({"ROS_MASTER_URI": os.environ["ROS_MASTER_URI"], "ROS_LOG_DIR": folder, "ROS_HOME": folder})
    try:
        tree.start(["roscore", "-p", str(port)], logs / "master.log")
        if not wait_until(_master_answers, DEADLINE_S):
            raise RuntimeError("the master did not come up")
        for name, value in (parameters or {}).items():
            rospy.get_master().target.setParam("/bench", name, value)
        command = ["roslaunch", "--wait", "metacontrol_sim", "MVP_metacontrol_world.launch"]
        tree.start([*command, f"nav_profile:={profile}"], logs / "console.log")
        rospy.init_node("bench_changes", disable_signals=True, anonymous=True)
        yield System()
    finally:
        rospy.signal_shutdown("measured")
        tree.close()


def _master_answers() -> bool:
    try:
        return bool(rospy.get_master().getPid())
    except OSError:
        return False


def changes(
    configurations: tuple[str, str], count: int, parameters: dict[str, Any] | None = None, pause: float = 0.0
) -> list[Change]:
    """Change to and fro between two configurations while the robot drives.

    Args:
        configurations: the first one is deployed at the start.
        count: of changes.
        parameters: set before the system starts, by full name.
        pause: from the robot driving again to the next change, s: failures do not come in salvos.
    """
    found = []
    with tempfile.TemporaryDirectory() as folder:
        with running_system(Path(folder), configurations[0], parameters) as system:
            for number in range(count):
                if system.distance() < NEAR_M:
                    system.set_off()
                if not system.drives():
                    raise RuntimeError("the robot does not drive")
                time.sleep(pause)
                found.append(system.change(configurations[(number + 1) % 2]))
        _parts(found, Path(folder))
    return found


def entries(
    name: str,
    values: list[float],
    unit: str,
    peer: str | None = None,
    peer_value: float | None = None,
    tail: bool = True,
) -> list[dict[str, Any]]:
    """Return what `./mros bench` writes: the median, and the 95th percentile as NAME_p95."""
    figures = {name: statistics.median(values)}
    if tail:
        figures[f"{name}_p95"] = percentile(values, 0.95)
    return [entry(key, value, unit, len(values), peer, peer_value) for key, value in figures.items()]
