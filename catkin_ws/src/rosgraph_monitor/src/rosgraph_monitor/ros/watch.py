"""ROS shell of `rosrun rosgraph_monitor watch`: live tables of functions, nodes, qualities and findings."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from typing import NoReturn

import click
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from metacontrol_bags import ownership
from metacontrol_msgs.msg import ActiveConfiguration
from node_kit.io.xml_rpc import CallError
from node_kit.ros.command import leaving_by_signals
from node_kit.ros.connections import connect_to_all, latest
from node_kit.ros.handshakes import greet_apart
from node_kit.ros.lifetime import BAD_START, LONGEST_END, Lifetime
from node_kit.ros.parts import TOPIC as SIGNS
from node_kit.ros.parts import sign_of
from rich.console import Console, Group, RenderableType
from rich.live import Live
from ros_model.graph.snapshot import GraphSnapshot
from ros_model.io.master import MasterClient

from rosgraph_monitor.diagnostics.overview import Overview, of_robot

_REFRESH = 0.5  # s, wall
_PRINT_PERIOD = 2.0  # s, wall, where the output is a file or a pipe, which keeps everything


def main() -> None:
    """Run the command with the arguments that are not roslaunch's."""
    command.main(args=rospy.myargv()[1:], prog_name="watch")


@click.command()
@click.option("--once", type=float, metavar="S", help="Listen for so many seconds, print once and end.")
def command(once: float | None) -> None:
    """Show what runs and what the monitor says, live, until Ctrl-C; into a pipe, print it whenever it differs.

    For a robot in a namespace, set ROS_NAMESPACE.

    Exit status: 2 without a ROS master.
    """
    life = Lifetime("watch")  # not begun: signals are the terminal's, which is put in order at the end
    try:
        client = MasterClient(rosgraph.get_master_uri(), "/watch")
        graph = client.snapshot()
    except CallError as error:
        life.say(f"{error}: start roscore or set ROS_MASTER_URI")
        sys.exit(BAD_START)
    rospy.on_shutdown(lambda: life.cut_off(LONGEST_END))
    connect_to_all()
    with leaving_by_signals():
        rospy.init_node("rosgraph_watch", anonymous=True, disable_signals=True)
    greet_apart()
    overview, lock = Overview(), threading.Lock()
    topic, robot = rospy.resolve_name(ownership.TOPIC), rospy.get_namespace()

    def take(msg: DiagnosticArray) -> None:
        own = ownership.own(msg.status, robot, msg._connection_header.get("callerid", ""), topic)
        with lock:
            overview.take(own, time.monotonic())

    def take_configuration(message: ActiveConfiguration) -> None:
        with lock:
            overview.take_configuration(message)

    def take_sign(status: DiagnosticStatus) -> None:
        with lock:
            overview.parts.hear(sign_of(status), time.monotonic())

    rospy.Subscriber(ownership.TOPIC, DiagnosticArray, take, queue_size=100)
    rospy.Subscriber(SIGNS, DiagnosticStatus, take_sign, queue_size=50)
    rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, latest(take_configuration))

    def tables(graph: GraphSnapshot) -> Group:
        with lock:
            return overview.render(*of_robot(graph.nodes, graph.parameters, robot), time.monotonic())

    console = Console()
    try:
        if once is not None:
            time.sleep(once)
            console.print(tables(graph))
            return
        if not console.is_terminal:
            _print_changes(lambda: tables(client.snapshot()))
        with Live(console=console, screen=True, auto_refresh=False) as live:
            while True:
                live.update(tables(graph), refresh=True)
                time.sleep(_REFRESH)
                graph = client.snapshot()
    except KeyboardInterrupt:
        return
    except BrokenPipeError:  # nobody reads any more; what is left must not be written at the end either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except CallError as error:
        life.say(str(error))


def _print_changes(table: Callable[[], RenderableType]) -> NoReturn:
    """Print a table whenever it differs from the last one.

    Raises:
        CallError: the master does not answer.
        KeyboardInterrupt: the user has seen enough.
        BrokenPipeError: nobody reads any more.
    """
    console, last = Console(), ""
    while True:
        with console.capture() as capture:
            console.print(table())
        if capture.get() != last:
            last = capture.get()
            sys.stdout.write(last)
            sys.stdout.flush()
        time.sleep(_PRINT_PERIOD)
