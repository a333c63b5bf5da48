"""Run one mission: start a master, the system and the recorder, and end all of them again."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Protocol, TypeVar

from node_kit.io.x_display import DisplayError, held_display
from roslib.packages import find_node
from rospkg import ResourceNotFound

from metacontrol_experiments.io.end_of_system import EndOfSystem
from metacontrol_experiments.io.processes import (
    ProcessTree,
    RunError,
    alone_in,
    is_free,
    reserved_port,
    signals_as_interrupts,
)
from metacontrol_experiments.io.recorder import Recorder
from metacontrol_experiments.mission.settings import BAG_NAME, RESULTS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.ros.mission_node import MissionNode

RECORDER = "/mission_recorder"

_LAUNCH_GRACE_S = 12.0
"""Wall seconds after which the system, once asked to end, is made to."""


class Settings(Protocol):
    """What a mission of any demonstrator tells."""

    @property
    def output(self) -> Path:
        """Folder for its bag and logs."""

    @property
    def port(self) -> int | None:
        """Of its master; None for a free one."""

    @property
    def topics(self) -> Collection[str]:
        """What is recorded."""

    @property
    def windows(self) -> Collection[str]:
        """Options that open a window."""

    def launch_command(self, port: int) -> list[str]:
        """Return the roslaunch command of the whole system, with a master on this port."""


Node = TypeVar("Node", bound="MissionNode")
Make = Callable[["ProcessTree", "Display", Callable[[], None]], Node]
"""Returns the node of a mission, given the processes of its run, where to show it, and what checks that they run."""


def run_mission(settings: Settings, display: Display, make: Make[Node]) -> Node:
    """Run a mission and record it to OUTPUT/mission.bag; return its node, which knows how it ended.

    Results that are in the folder go once the mission begins: a system that does not start takes nothing away.
    Whatever happens, no process of the run is left behind.

    Raises:
        RunError: the system did not come up, the mission cannot be run as asked for, or its bag is not whole.
        KeyboardInterrupt: it was interrupted; the bag is complete up to then.
    """
    _check_windows(settings.windows)
    log = settings.output / "log"
    bag = settings.output / BAG_NAME
    for folder in (settings.output, log):
        folder.mkdir(parents=True, exist_ok=True)
    with alone_in(settings.output):
        return _run_alone(settings, display, make, log, bag)


def _run_alone(settings: Settings, display: Display, make: Make[Node], log: Path, bag: Path) -> Node:
    if settings.port is not None and not is_free(settings.port):
        raise RunError(
            f"--port: port {settings.port} is in use or not allowed: choose another, or leave the option out"
        )
    with nullcontext(settings.port) if settings.port else reserved_port() as port:
        return _run_on(port, settings, display, make, log, bag)


def _run_on(port: int, settings: Settings, display: Display, make: Make[Node], log: Path, bag: Path) -> Node:
    environment = {
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
        "ROS_HOME": str(log.resolve()),
        "ROS_LOG_DIR": str(log.resolve()),
    }
    for name in ("ROS_IP", "ROS_NAMESPACE"):  # of the robot that the user works with otherwise
        os.environ.pop(name, None)
    os.environ.update(environment)
    tree = ProcessTree(environment)
    with signals_as_interrupts(), _closing(tree):
        return _run(settings, display, make, tree, port, bag)


def _run(settings: Settings, display: Display, make: Make[Node], tree: ProcessTree, port: int, bag: Path) -> Node:
    from metacontrol_experiments.mission.mission import MissionError
    from metacontrol_experiments.ros.startup import StartError  # rospy reads the environment when imported

    console = settings.output / "log" / "console.log"
    display.say(f"starting the system on port {port}, its console is {console}")
    launch = tree.start(settings.launch_command(port), console)
    recorder = Recorder(tree, bag, settings.output / "log" / "recorder.log", display.say)
    end = EndOfSystem(console, os.environ["ROS_MASTER_URI"])
    is_driving = False

    def check() -> None:
        if launch.poll() is not None:
            raise StartError(f"roslaunch has ended: {end.cause()}")
        if end.has_begun():
            raise StartError(f"roslaunch ends: {end.cause()}")
        if not is_driving and recorder.ended:
            raise StartError(f"the recorder has ended: {recorder.ended}")
        recorder.watch()

    node = None
    try:
        node = make(tree, display, check)
        node.start_up()
        end.watch()
        recorder.start(_record_command(bag, settings.topics))
        node.wait_recorded(RECORDER, settings.topics)
        for name in RESULTS:  # of an earlier run
            (settings.output / name).unlink(missing_ok=True)
        is_driving = True
        node.drive()
    except (StartError, MissionError) as error:
        raise RunError(f"{error}; see {console}") from error
    finally:
        if node is not None:
            node.close()
    display.say("mission over, ending the system")
    recorder.stop()
    tree.stop(launch, _LAUNCH_GRACE_S)
    return node


def _check_windows(options: Collection[str]) -> None:
    """Check that the windows can open that options ask for.

    Raises:
        RunError: there is no display, or no RViz.
    """
    if "--rviz" in options and not _find("rviz", "rviz"):
        raise RunError("--rviz: RViz is not installed: ./mros setup --gui, or leave the option out")
    if options:
        try:
            with held_display():
                pass
        except DisplayError as error:
            raise RunError(f"{', '.join(options)}: {error}") from error


def _find(package: str, kind: str) -> str:
    """Return the path of a node's program; empty where it is not installed."""
    try:
        return next(iter(find_node(package, kind)), "")
    except ResourceNotFound:
        return ""


def _record_command(bag: Path, topics: Collection[str]) -> list[str]:
    """Return the command of the recorder itself: its Python front end would not pass signals on.

    Raises:
        RunError: rosbag is not installed.
    """
    found = _find("rosbag", "record")
    if not found:
        raise RunError("rosbag's recorder is not installed; on Debian it is in the package rosbag")
    return [found, "-O", str(bag), "--min-space", "64M", *topics, f"__name:={RECORDER.lstrip('/')}"]


@contextmanager
def _closing(tree: ProcessTree) -> Iterator[None]:
    """End the processes at the end, without being disturbed by signals."""
    try:
        yield
    finally:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        tree.close()
