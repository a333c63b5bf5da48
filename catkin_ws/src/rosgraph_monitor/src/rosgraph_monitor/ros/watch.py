"""ROS shell of `rosrun rosgraph_monitor watch`: a live table of nodes, qualities, thresholds and findings."""

from __future__ import annotations

import argparse
import sys
import threading
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from node_kit.ros.lifetime import BAD_START, LONGEST_END, Lifetime
from rich.console import Console
from rich.live import Live
from ros_model.graph.snapshot import GraphSnapshot
from ros_model.io.master import MasterClient, SnapshotError

from rosgraph_monitor.diagnostics.overview import Board

_REFRESH = 0.5


def main() -> None:
    """Show the table until the user interrupts it; exit with status 2 and one line without a master."""
    parser = argparse.ArgumentParser(prog="watch", description="A live table of what the monitor says.")
    parser.add_argument("--once", type=float, metavar="S", help="listen for so many seconds, print once and end")
    options = parser.parse_args(rospy.myargv()[1:])
    client = MasterClient(rosgraph.get_master_uri(), "/watch")
    life = Lifetime("watch")  # not begun: signals are the terminal's, which is put in order at the end
    try:
        graph = client.snapshot()
    except SnapshotError as error:
        life.say(f"{error}: start roscore or set ROS_MASTER_URI")
        sys.exit(BAD_START)
    rospy.on_shutdown(lambda: life.cut_off(LONGEST_END))
    rospy.init_node("rosgraph_watch", anonymous=True, disable_signals=True)
    board, lock = Board(), threading.Lock()

    def take(msg: DiagnosticArray) -> None:
        with lock:
            board.take(msg.status, time.monotonic())

    rospy.Subscriber("/diagnostics", DiagnosticArray, take, queue_size=100)
    console = Console()
    try:
        if options.once is not None:
            time.sleep(options.once)
            with lock:
                console.print(board.render(graph.nodes, graph.parameters, time.monotonic()))
        else:
            _show(console, client, graph, board, lock)
    except KeyboardInterrupt:
        return
    except SnapshotError as error:
        life.say(str(error))


def _show(console: Console, client: MasterClient, graph: GraphSnapshot, board: Board, lock: threading.Lock) -> None:
    with Live(console=console, screen=console.is_terminal, auto_refresh=False) as live:
        while True:
            with lock:
                tables = board.render(graph.nodes, graph.parameters, time.monotonic())
            live.update(tables, refresh=True)
            time.sleep(_REFRESH)
            graph = client.snapshot()
