"""The summary of a mission of D1 from its record."""

from dataclasses import replace

import numpy as np
import pytest
from metacontrol_bags.decision import DECIDED, EXECUTED, Decision
from metacontrol_bags.metrics import MetricsError
from metacontrol_bags.record import Event, GoalReport, MissionRecord
from metacontrol_bags.words import MissionEvent
from metacontrol_experiments.pyramid.record import PyramidRecord, Stop
from metacontrol_experiments.pyramid.summary import placed, summarise_pyramid
from metacontrol_manipulation.pick_place.pyramid import SLOTS

START, DONE, END = 10.0, 60.0, 65.5
SUCCEEDED, ABORTED = 3, 4
BUILT = np.array([[*slot.position, 0.0, 0.0, 0.0, 1.0] for slot in SLOTS])


def still(speed=0.0):
    stamps = np.arange(START, END, 0.1)
    return np.column_stack([stamps, np.full_like(stamps, speed), np.zeros_like(stamps)])


def record(blocks=None, status=SUCCEEDED, text="", told=None, decisions=(), events=(), stops=(), arms=None):
    stamps = np.arange(START, END, 0.5)
    built = np.repeat(BUILT[np.newaxis], len(stamps), axis=0) if blocks is None else blocks(stamps)
    values = {"goal_id": "g", "scenario": "2", "seed": "7", "metacontrol": "true", "can_be_built": "true"} | (
        told or {}
    )
    return PyramidRecord(
        MissionRecord(
            events=(
                Event(START, MissionEvent.MISSION_START, "", values),
                *events,
                Event(END, MissionEvent.MISSION_END, "", {"outcome": "reached", "wall_duration_s": "50"}),
            ),
            decisions=tuple(decisions),
            results=(GoalReport(DONE, "g", status, text),),
        ),
        stops=tuple(stops),
        base=np.column_stack([still(), np.zeros((len(still()), 2))]),
        arms=arms or {"left": still(), "right": still()},
        block_stamps=stamps,
        blocks=built,
    )


def test_pyramid_that_stands_is_a_success():
    summary = summarise_pyramid(record())
    assert (summary["success"], summary["placed"], summary["placed_lost"]) == (True, 6, 0)
    assert (summary["scenario"], summary["seed"], summary["duration_s"]) == (2, 7, 50.0)
    assert summary["real_time_factor"] == pytest.approx(55.5 / 50.0, abs=1e-3)


def test_block_beside_its_slot_is_not_in_place():
    def blocks(stamps):
        built = np.repeat(BUILT[np.newaxis], len(stamps), axis=0).copy()
        built[:, 5, 0] += 0.012
        return built

    summary = summarise_pyramid(record(blocks))
    assert (summary["success"], summary["placed"]) == (False, 5)


def test_pyramid_that_creeps_does_not_stand():
    def blocks(stamps):
        built = np.repeat(BUILT[np.newaxis], len(stamps), axis=0).copy()
        built[:, 5, 1] += 0.0005 * (stamps - END)
        return built

    summary = summarise_pyramid(record(blocks))
    assert (summary["success"], summary["placed"]) == (False, 6)
    assert summary["moved_mm"] > 2.0


def test_block_that_was_in_place_and_is_taken_away_is_lost():
    def blocks(stamps):
        built = np.repeat(BUILT[np.newaxis], len(stamps), axis=0).copy()
        built[(stamps > 20.0) & (stamps < 30.0), 5, 2] += 0.1
        return built

    assert summarise_pyramid(record(blocks))["placed_lost"] == 1


def test_goal_that_was_not_reached_is_none_though_the_pyramid_stands():
    assert not summarise_pyramid(record(status=ABORTED, text="given up"))["success"]


@pytest.mark.parametrize(
    ("text", "speed", "success"), [("no arm works", 0.0, True), ("", 0.0, False), ("no arm works", 0.2, False)]
)
def test_where_no_design_is_left_the_robot_stops_and_says_why(text, speed, success):
    arms = {"left": still(speed), "right": still()}
    asked = record(status=ABORTED, text=text, told={"can_be_built": "false"}, arms=arms)
    assert summarise_pyramid(asked)["success"] is success


def adapted(number, decided, executed, trigger="component:left_arm"):
    decision = Decision(str(number), DECIDED, "o", trigger, "", "fd2_1", decided)
    yield decision
    yield replace(decision, state=EXECUTED, stamp=executed, stamp_executed=executed)


def test_recovery_is_from_the_arm_s_stop_to_the_first_motion_after_the_last_change():
    arms = {"left": still(), "right": still()}
    arms["right"][(arms["right"][:, 0] > 20.5) & (arms["right"][:, 0] < 21.5), 1] = 0.4  # before the last change
    arms["right"][arms["right"][:, 0] > 24.0, 1] = 0.4
    asked = record(
        events=[Event(19.0, MissionEvent.PERTURBATION, "obstacle:left", {})],
        stops=[Stop(20.0, "left", True)],
        decisions=[*adapted(1, 20.1, 21.0), *adapted(2, 21.1, 23.0)],
        arms=arms,
    )
    (strike,) = summarise_pyramid(asked)["strikes"]
    assert (strike["stamp_s"], strike["cause_s"]) == (9.0, 10.0)
    assert strike["recover_s"] == pytest.approx(4.1, abs=0.11)


def test_recovery_counts_what_its_cause_has_triggered():
    arms = {"left": still(0.4), "right": still()}
    events = [
        Event(20.0, MissionEvent.PERTURBATION, "light:0.04", {}),
        Event(30.0, MissionEvent.PERTURBATION, "component:camera", {}),
    ]
    made = [*adapted(1, 20.3, 20.5, "environment:light"), *adapted(2, 29.95, 31.0, "component:camera")]
    asked = record(events=events, decisions=made, arms=arms)
    first, second = summarise_pyramid(asked)["strikes"]
    assert first["recover_s"] == pytest.approx(0.5, abs=0.11)
    assert second["recover_s"] == pytest.approx(1.0, abs=0.11)


def test_obstacle_that_no_arm_has_met_is_no_cause():
    asked = record(events=[Event(19.0, MissionEvent.PERTURBATION, "obstacle:left", {})])
    assert summarise_pyramid(asked)["strikes"] == []


def test_distance_is_that_of_the_nearest_block():
    assert placed(BUILT[::-1, :3]) == pytest.approx(np.zeros(6))


@pytest.mark.parametrize("seed", ["inf", "many"])
def test_impossible_number_of_an_event_is_named(seed):
    with pytest.raises(MetricsError, match=f"seed is '{seed}'"):
        summarise_pyramid(record(told={"seed": seed}))
