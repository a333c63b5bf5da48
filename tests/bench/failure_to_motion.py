"""Time from the SIGKILL of the laser's driver to the robot moving again, on the camera: wall, real-time factor 1.

Missions with the meta-controller, whose driver is killed on the way. "Moving again" is the first moment at which the
controller of the camera's variant commands a motion and the robot, by the ground truth, goes faster than 0.05 m/s. The
manipulator calls the variant deployed when it has run for the settling time, too: that is `failure_to_deployed`.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from metacontrol_bags.bag import read_record
from metacontrol_bags.bag_file import BagFile, Connection
from metacontrol_bags.decoding import decode
from metacontrol_bags.words import Decision, DiagnosticWords, FunctionGrounding
from support.figures import LIMIT, entry
from support.missions import drive

if TYPE_CHECKING:
    from collections.abc import Iterable

_MISSIONS = 3
_LIMIT_S = 2.0  # what was asked for
_MOVING_MPS = 0.05
_WINDOW = 10  # samples of 0.02 s over which the speed is taken
_TIMEOUT_S = 30.0  # simulated; the mission need not reach its goal
_DRIVER = "front_laser"


def run() -> list[dict[str, Any]]:
    """Return the entry `failure_to_motion`, and one for the end of each part of that time: medians in s."""
    missions = [_measure(seed) for seed in range(1, _MISSIONS + 1)]
    medians = {name: statistics.median(times[name] for times in missions) for name in missions[0]}
    limits = {"failure_to_motion": (LIMIT, _LIMIT_S)}
    return [entry(name, time, "s", len(missions), *limits.get(name, ())) for name, time in medians.items()]


def _measure(seed: int) -> dict[str, float]:
    """Return the times of one mission in s; at real-time factor 1 simulated and wall time are the same."""
    with tempfile.TemporaryDirectory(prefix="bench_") as folder:
        options = ("--seed", str(seed), "--contingency", f"kill:{_DRIVER}@time:8", "--timeout", str(_TIMEOUT_S))
        drive(folder, *options)
        bag = Path(folder) / "mission.bag"
        record, commands = read_record(bag), _commands(bag)
    event = record.event("PERTURBATION")
    killed = _first([event.stamp] if event else [], "the driver was not killed")
    on_camera = [report for report in record.configurations if report.configuration.endswith("_k")]
    begun = _first(_in_state(on_camera, FunctionGrounding.RECONFIGURING), "no variant on the camera was chosen")
    stopped = _first(
        (t for t, node, _ in commands if t >= begun and node == "/rosgraph_manipulator"), "the robot was not stopped"
    )
    driven = _first((t for t, _, moves in commands if t > stopped and moves), "no motion was commanded")
    stamps, way = record.poses[:, 0], record.poses[:, 1:]
    speeds = np.hypot(*(way[_WINDOW:] - way[:-_WINDOW]).T) / (stamps[_WINDOW:] - stamps[:-_WINDOW])
    moving = stamps[:-_WINDOW][(stamps[:-_WINDOW] >= driven) & (speeds > _MOVING_MPS)]
    reported = (r.stamp for r in record.components if r.stamp >= killed and r.status == DiagnosticWords.COMPONENT_FALSE)
    decided = (d.stamp for d in record.decisions if d.stamp >= killed and d.state == Decision.DECIDED)
    ends = {
        "failure_to_motion": _first(moving, "the robot did not move again"),
        "failure_to_report": _first(reported, "the failure was not reported"),
        "failure_to_decision": _first(decided, "nothing was decided"),
        "failure_to_change": begun,
        "failure_to_stop": stopped,
        "failure_to_command": driven,
        "failure_to_deployed": _first(_in_state(on_camera, FunctionGrounding.STABLE), "no variant was deployed"),
    }
    return {name: float(end - killed) for name, end in ends.items()}


def _commands(path: Path) -> list[tuple[float, str, bool]]:
    """Return stamp (s), node and whether it is a motion, for each command of the robot's velocity in a bag."""
    found: list[tuple[float, str, bool]] = []

    def take(connection: Connection, nanoseconds: int, twist: Any) -> None:
        moves = any((twist.linear.x, twist.linear.y, twist.angular.z))
        found.append((nanoseconds * 1e-9, connection.publisher, moves))

    with BagFile(path) as bag:
        decode(bag, lambda connection: connection.topic == "/cmd_vel", take)
    return found


def _in_state(reports: Iterable[Any], state: str) -> list[float]:
    return [report.stamp for report in reports if report.state == state]


def _first(stamps: Iterable[float], otherwise: str) -> float:
    """Return the first of stamps.

    Raises:
        RuntimeError: there is none.
    """
    for stamp in stamps:
        return stamp
    raise RuntimeError(otherwise)
