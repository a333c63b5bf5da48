"""What a bag does not tell of a mission, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from metacontrol_bags.printable import printable
from metacontrol_bags.words import MissionEvent

if TYPE_CHECKING:
    from metacontrol_bags.bag import Salvaged
    from metacontrol_bags.record import MissionRecord

_TELLS = {
    "/mission/event": "settings, start and end",
    "/ground_truth/state": "the way",
    "/ground_truth/safety": "safety",
    "/ground_truth/energy": "energy",
    "/ground_truth/contacts": "collisions",
    "/diagnostics": "what was observed",
    "/move_base/goal": "goals",
    "/rosgraph_manipulator/active_configuration": "configurations",
}
_TELLS_OF_ANY_ROBOT = {
    "/diagnostics": "components and qualities",
    "/mros1_reasoner/decision": "decisions, if any",
    "/rosgraph_manipulator/active_configuration": "configurations",
}
_NAMED = 4
"""Topics of a bag of something else that a line names."""
_HOLE_S = 0.5
"""s between two poses from which on something is missing: the ground truth has 20 or more a second."""


def is_mission(record: MissionRecord) -> bool:
    """Return whether a record holds anything of a mission."""
    told = (record.events, record.decisions, record.configurations, record.goals, record.observed, record.components)
    return any((*told, record.contacts, *record.true_quality.values(), len(record.poses)))


def is_d2(record: MissionRecord) -> bool:
    """Return whether a record is of a mission of D2, or of a robot without a meta-controller, as published bags are."""
    began = record.event(MissionEvent.MISSION_START)
    if began is not None:
        return began.values.get("mission", "D2") == "D2"
    return any(record.true_quality.values()) or not (record.decisions or record.configurations)


def holes(record: MissionRecord) -> list[tuple[float, float]]:
    """Return the spans of the mission without a pose of the ground truth: their begin and end in s of ROS time.

    None where nothing of the ground truth was recorded at all.
    """
    start, end = record.start_stamp, record.end_stamp
    stamps = record.poses[:, 0]
    if not stamps.size or end <= start:
        return []
    edges = np.concatenate(([start], stamps[(stamps > start) & (stamps < end)], [end]))
    wide = np.flatnonzero(np.diff(edges) > _HOLE_S)
    return [(float(edges[i]), float(edges[i + 1])) for i in wide]


def holes_in_words(record: MissionRecord) -> tuple[str, ...]:
    """Return a line for the holes of a record; empty if it has none."""
    start = record.start_stamp
    spans = [f"{since - start:.1f} to {until - start:.1f} s" for since, until in holes(record)]
    if not spans:
        return ()
    more = f" and {len(spans) - _NAMED} more" if len(spans) > _NAMED else ""
    return (
        f"it has holes: nothing of the robot's way was recorded from {', '.join(spans[:_NAMED])}{more} of the mission, "
        "so way, shares and means are not of all of it",
    )


def gaps(found: Salvaged) -> tuple[str, ...]:
    """Return what is lost or was not recorded, each in words."""
    told = list(found.problems)
    if not is_d2(found.record):
        absent = [f"{topic} ({what})" for topic, what in _TELLS_OF_ANY_ROBOT.items() if topic not in found.topics]
        return (*told, *([f"it has no {', no '.join(absent)}: record these, too"] if absent else []))
    absent = [f"{topic} ({what})" for topic, what in _TELLS.items() if topic not in found.topics]
    if absent:
        told.append(
            f"it has no {', no '.join(absent)}: what follows from these is unknown, `metacontrol run` records all"
        )
    elif found.record.event(MissionEvent.MISSION_START) is None:
        told.append("the start of the mission is not in it: the first message is taken for it")
    elif found.record.event(MissionEvent.MISSION_END) is None:
        told.append("the end of the mission is not in it: the last message is taken for it")
    return (*told, *holes_in_words(found.record))


def nothing_of_a_mission(found: Salvaged) -> str:
    """Return what to say of a bag that holds nothing of a mission."""
    if not found.topics:
        lost = f" ({'; '.join(found.problems)})" if found.problems else ""
        return f"holds no messages{lost}: record again"
    topics = [printable(topic) for topic in sorted(found.topics)]
    more = f" and {len(topics) - _NAMED} more" if len(topics) > _NAMED else ""
    lost = f" ({'; '.join(found.problems)})" if found.problems else ""
    return (
        f"holds nothing of a mission, only {', '.join(topics[:_NAMED])}{more}{lost}: "
        "record the topics that the README of metacontrol_bags lists"
    )
