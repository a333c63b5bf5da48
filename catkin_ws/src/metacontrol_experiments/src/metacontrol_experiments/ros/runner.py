"""Run one mission: start a master, the system and the recorder, and end all of them again."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol, TypeVar

from roslib.packages import find_node
from rospkg import ResourceNotFound

from metacontrol_experiments.io.processes import (
    ProcessTree,
    RunError,
    alone_in,
    free_port,
    is_free,
    signals_as_interrupts,
)
from metacontrol_experiments.mission.settings import BAG_NAME

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from metacontrol_experiments.io.display import Display
    from metacontrol_experiments.ros.mission_node import MissionNode

RECORDER = "/mission_recorder"

_RECORDER_GRACE_S = 15.0
_LAUNCH_GRACE_S = 12.0
"""Wall seconds after which a process that was asked to end is made to."""

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_POINTER = ("The traceback for the exception", "log file:")
_COMPLAINT = re.compile(r"error|exception|fatal|has died|unused args|invalid|no such", re.IGNORECASE)


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

    def launch_command(self, port: int) -> list[str]:
        """Return the roslaunch command of the whole system, with a master on this port."""


Node = TypeVar("Node", bound="MissionNode")
Make = Callable[["ProcessTree", "Display", Callable[[], None]], Node]
"""Returns the node of a mission, given the processes of its run, where to show it, and what checks that they run."""


def run_mission(settings: Settings, display: Display, make: Make[Node]) -> Node:
    """Run a mission and record it to OUTPUT/mission.bag; return its node, which knows how it ended.

    Whatever happens, no process of the run is left behind.

    Raises:
        RunError: the system did not come up, or the mission cannot be run as asked for.
        KeyboardInterrupt: it was interrupted; the bag is complete up to then.
    """
    log = settings.output / "log"
    bag = settings.output / BAG_NAME
    for folder in (settings.output, log):
        folder.mkdir(parents=True, exist_ok=True)
    with alone_in(settings.output):
        return _run_alone(settings, display, make, log, bag)


def _run_alone(settings: Settings, display: Display, make: Make[Node], log: Path, bag: Path) -> Node:
    for old in (bag, bag.with_name(bag.name + ".active")):
        old.unlink(missing_ok=True)
    if settings.port is not None and not is_free(settings.port):
        raise RunError(
            f"--port: port {settings.port} is in use or not allowed: choose another, or leave the option out"
        )
    port = settings.port or free_port()
    environment = {
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
        "ROS_HOME": str(log.resolve()),
        "ROS_LOG_DIR": str(log.resolve()),
    }
    os.environ.pop("ROS_IP", None)
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

    def check() -> None:
        if launch.poll() is not None:
            raise StartError(f"roslaunch has ended: {_last_complaint(console)}")

    node = None
    try:
        node = make(tree, display, check)
        node.start_up()
        recorder = tree.start(_record_command(bag, settings.topics), settings.output / "log" / "recorder.log")
        node.wait_recorded(RECORDER, settings.topics)
        node.drive()
    except (StartError, MissionError) as error:
        raise RunError(f"{error}; see {console}") from error
    finally:
        if node is not None:
            node.close()
    display.say("mission over, ending the system")
    tree.stop(recorder, _RECORDER_GRACE_S)
    tree.stop(launch, _LAUNCH_GRACE_S)
    if not bag.exists():
        raise RunError(f"the recorder left no {bag}; see {settings.output / 'log' / 'recorder.log'}")
    return node


def _record_command(bag: Path, topics: Collection[str]) -> list[str]:
    """Return the command of the recorder itself: its Python front end would not pass signals on.

    Raises:
        RunError: rosbag is not installed.
    """
    try:
        found = find_node("rosbag", "record")
    except ResourceNotFound:
        found = []
    if not found:
        raise RunError("rosbag's recorder is not installed; on Debian it is in the package rosbag")
    return [found[0], "-O", str(bag), "--min-space", "64M", *topics, f"__name:={RECORDER.lstrip('/')}"]


def _last_complaint(console: Path) -> str:
    """Return the last line of a log that tells of an error, else the last line."""
    text = _COLOUR.sub("", console.read_text(encoding="utf-8", errors="replace"))
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith(_POINTER)]
    return ([line for line in lines if _COMPLAINT.search(line)] or lines or ["it said nothing"])[-1]


@contextmanager
def _closing(tree: ProcessTree) -> Iterator[None]:
    """End the processes at the end, without being disturbed by signals."""
    try:
        yield
    finally:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        tree.close()
