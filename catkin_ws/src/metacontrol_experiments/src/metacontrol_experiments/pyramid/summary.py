"""The summary of a mission of D1, from its record alone.

Definitions
- A block is in place if it is within 1 cm of a slot of the pyramid. The pyramid stands if all slots are filled, and no
  block has moved by more than 1 mm in the 5 s after the goal's end.
- `success`: the pyramid stands, and the action's goal has succeeded. Where no design is left, the robot is to stop
  safely and say why: then `success` is that it stands still from 1 s after the goal's end on, the goal was aborted with
  a reason, and no block that was in place is lost.
- `recover_s` of a strike: from its cause to the robot's next motion. The cause is the arm's safety stop, or the strike
  itself. The next motion is the first one, of the base or of any arm, after the last change that it caused was
  carried out: often the stopped arm goes back out of the way first. None where nothing was changed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.metrics import number, reconfigurations, rounded
from metacontrol_bags.words import MissionEvent
from metacontrol_manipulation.pick_place.pyramid import SLOTS

if TYPE_CHECKING:
    from metacontrol_bags.record import Event
    from numpy.typing import NDArray

    from metacontrol_experiments.pyramid.record import PyramidRecord

SCHEMA_VERSION = 1
IN_PLACE = 0.01
"""m from its slot within which a block is in place."""
_STILL = 0.001
"""m by which a block that stands may seem to move."""
_WATCH_S = 5.0
"""s after the goal's end for which a pyramid has to stand."""
_STOPPING_S = 1.0
"""s after the goal's end in which the robot may still move."""
_MOVES_ARM, _MOVES_BASE = 0.05, 0.02
"""rad/s of a joint and m/s of the base from which on it moves: servos that hold a place are slower."""
_FOLLOWS_S = 20.0
"""s after a cause within which a decision with its trigger follows it, if no other such cause comes between."""
_SAME_MOMENT_S = 0.1
"""s by which the clocks of two nodes may differ."""
_SLOT_PLACES = np.array([slot.position for slot in SLOTS])


def placed(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance in m of the nearest block to each slot, given positions (n, 3)."""
    return np.linalg.norm(_SLOT_PLACES[:, np.newaxis] - positions[np.newaxis], axis=2).min(axis=1)


def summarise_pyramid(record: PyramidRecord) -> dict[str, Any]:
    """Return the content of summary.json.

    Raises:
        MetricsError: an event of the mission says what cannot be.
    """
    mission = record.mission
    began, ended = mission.event(MissionEvent.MISSION_START), mission.event(MissionEvent.MISSION_END)
    told, closing = began.values if began else {}, ended.values if ended else {}
    start, end = mission.start_stamp, mission.end_stamp
    result = next((r for r in mission.results if r.id == told.get("goal_id") and r.stamp >= start), None)
    done = result.stamp if result else end
    succeeded = bool(result and result.status == GoalStatus.SUCCEEDED.value)
    distances = placed(record.blocks[-1, :, :3])
    moved = _moved(record, done)
    is_pyramid = bool((distances <= IN_PLACE).all() and moved <= _STILL and end - done >= _WATCH_S - 0.1)
    lost = _lost(record, start)
    still = _stands_still(record, done + _STOPPING_S, end)
    safe = not succeeded and bool(result and result.text) and still and not lost
    can_be_built = told.get("can_be_built", "true") == "true"
    return {
        "schema_version": SCHEMA_VERSION,
        "commit": told.get("commit", "unknown"),
        "mission": "D1",
        "scenario": int(number(told, "scenario", 0)),
        "seed": int(number(told, "seed", 0)),
        "metacontrol": told.get("metacontrol") == "true",
        "success": (is_pyramid and succeeded) if can_be_built else safe,
        "goal_reached": is_pyramid and succeeded,
        "outcome": closing.get("outcome", "unknown"),
        "reason": closing.get("reason", "the bag holds no end of the mission"),
        "duration_s": rounded(done - start),
        "placed": int((distances <= IN_PLACE).sum()),
        "placed_error_mm": rounded(float(distances[distances <= IN_PLACE].max(initial=0.0)) * 1000.0),
        "moved_mm": rounded(moved * 1000.0),
        "placed_lost": lost,
        "stands_still": still,
        "strikes": _strikes(record),
        "reconfigurations": reconfigurations(mission, EXECUTED),
        "reconfigurations_failed": reconfigurations(mission, FAILED),
        "refusals": [
            {"stamp_s": rounded(d.stamp - start), "objective": d.objective, "explanation": d.explanation}
            for d in mission.decisions
            if d.state == FAILED and not d.to_configuration and d.stamp >= start
        ],
        "tags_found": _mean(record.tag_share, start, done),
        "force_max_n": {arm: _largest(rows, start, end) for arm, rows in record.arms.items()},
        "real_time_factor": _factor(end - start, closing),
        "start_stamp_s": rounded(start),
    }


def causes(record: PyramidRecord) -> list[tuple[Event, float]]:
    """Return each strike with the moment of its cause: an obstacle is one when the arm stops; s of ROS time."""
    found = []
    for event in record.mission.events:
        if event.kind != MissionEvent.PERTURBATION:
            continue
        kind, _, what = event.name.partition(":")
        moment: float | None = event.stamp
        if kind == "obstacle":
            stops = (stop.stamp for stop in record.stops if stop.arm == what and stop.is_stopped)
            moment = next((stamp for stamp in stops if stamp >= event.stamp - 0.1), None)
        if moment is not None:
            found.append((event, moment))
    return found


def _strikes(record: PyramidRecord) -> list[dict[str, Any]]:
    start, found = record.mission.start_stamp, causes(record)
    told = []
    for index, (event, cause) in enumerate(found):
        later = (moment for other, moment in found[index + 1 :] if _triggers(other.name) == _triggers(event.name))
        until = next(later, math.inf)
        told.append(
            {
                "name": event.name,
                "stamp_s": rounded(event.stamp - start),
                "cause_s": rounded(cause - start),
                "recover_s": _recovery(record, cause, min(until, cause + _FOLLOWS_S), _triggers(event.name)),
            }
        )
    return told


def _triggers(strike: str) -> tuple[str, ...]:
    """Return by which triggers decisions follow a strike."""
    kind, _, what = strike.partition(":")
    if kind in ("obstacle", "release"):
        return (f"component:{what}_arm",)
    return ("environment:light", "qa:tag_share") if kind == "light" else (strike,)


def _recovery(record: PyramidRecord, cause: float, until: float, triggers: tuple[str, ...]) -> float | None:
    decided = [d for d in record.mission.decisions if d.state == DECIDED and d.trigger in triggers]
    followed = {d.id for d in decided if cause - _SAME_MOMENT_S <= d.stamp < until - _SAME_MOMENT_S}
    carried_out = [
        d.stamp_executed or d.stamp for d in record.mission.decisions if d.state == EXECUTED and d.id in followed
    ]
    if not carried_out:
        return None
    moves = [stamp for stamp in _motions(record) if stamp >= max(carried_out)]
    return rounded(min(moves) - cause) if moves else None


def _motions(record: PyramidRecord) -> list[float]:
    """Return the moments at which the base or an arm moves."""
    moments = record.base[record.base[:, 4] > _MOVES_BASE, 0].tolist()
    for rows in record.arms.values():
        moments += rows[rows[:, 1] > _MOVES_ARM, 0].tolist()
    return moments


def _stands_still(record: PyramidRecord, start: float, end: float) -> bool:
    arms = [rows[(rows[:, 0] > start) & (rows[:, 0] <= end), 1] for rows in record.arms.values()]
    base = record.base[(record.base[:, 0] > start) & (record.base[:, 0] <= end), 4]
    return bool(all((speeds <= _MOVES_ARM).all() for speeds in arms) and (base <= _MOVES_BASE).all())


def _moved(record: PyramidRecord, done: float) -> float:
    """Return by how much any block has moved since the goal's end, m."""
    after = record.blocks[record.block_stamps >= done, :, :3]
    return float(np.linalg.norm(after - after[-1], axis=2).max()) if len(after) else 0.0


def _lost(record: PyramidRecord, start: float) -> int:
    """Return how often a slot that was filled for a second was empty afterwards."""
    filled = np.array([placed(blocks[:, :3]) <= IN_PLACE for blocks in record.blocks[record.block_stamps >= start]])
    stamps = record.block_stamps[record.block_stamps >= start]
    lost = 0
    for slot in filled.T if len(filled) else ():
        since: float | None = None
        for stamp, is_filled in zip(stamps, slot, strict=True):
            if not is_filled:
                lost += int(since is not None and stamp - since >= 1.0)
                since = None
            elif since is None:
                since = stamp
    return lost


def _mean(rows: NDArray[np.float64], start: float, end: float) -> float | None:
    values = rows[(rows[:, 0] >= start) & (rows[:, 0] <= end), 1]
    return rounded(float(values.mean())) if len(values) else None


def _largest(rows: NDArray[np.float64], start: float, end: float) -> float | None:
    values = rows[(rows[:, 0] >= start) & (rows[:, 0] <= end), 2]
    return rounded(float(values.max())) if len(values) else None


def _factor(duration: float, closing: dict[str, str]) -> float | None:
    wall = number(closing, "wall_duration_s", 0.0)
    return rounded(duration / wall) if wall > 0.0 else None
