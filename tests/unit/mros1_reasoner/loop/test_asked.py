"""What an operator has asked for and still holds."""

import pytest
from mros1_reasoner.loop.asked import Asked, carry_out
from mros1_reasoner.loop.entries import (
    AddObjective,
    Approve,
    Lock,
    Pause,
    RemoveObjective,
    Resume,
    SetNfr,
    Unlock,
)
from mros1_reasoner.loop.readable_state import MapeError

WATER = AddObjective("o_water", "f_water", {"flow": 2.0})
FLOW = SetNfr("", "flow", 1.0)


@pytest.mark.parametrize(
    ("given", "holds"),
    [
        ([Pause(), Pause()], [Pause()]),
        ([Pause(), Resume()], []),
        ([Approve("decision-3")], []),
        ([Lock("o_water"), Lock("o_light"), Unlock("o_water")], [Lock("o_light")]),
        ([Lock("o_water"), Unlock("o_water")], []),
        ([Lock("o_water"), Lock(), Unlock()], []),
        ([FLOW, SetNfr("o_water", "flow", 3.0)], [FLOW, SetNfr("o_water", "flow", 3.0)]),
        ([SetNfr("o_water", "flow", 3.0), FLOW], [FLOW]),
        ([FLOW, SetNfr("", "warmth", 1.0)], [FLOW, SetNfr("", "warmth", 1.0)]),
        ([WATER, Lock("o_water"), RemoveObjective("o_water")], [RemoveObjective("o_water")]),
        ([RemoveObjective("o_water"), WATER], [RemoveObjective("o_water"), WATER]),
    ],
)
def test_later_commands_replace_what_they_take_back(given, holds):
    assert Asked(given).commands == tuple(holds)


@pytest.mark.parametrize(
    ("given", "holds"),
    [
        ([Lock()], [Lock("o_water"), Lock("o_light")]),
        ([Lock("o_later"), Lock()], [Lock("o_later"), Lock("o_water"), Lock("o_light")]),
        ([Lock("o_light"), Lock()], [Lock("o_water"), Lock("o_light")]),
        ([Lock("o_later"), Lock(), Unlock()], []),
        ([Lock(), Unlock("o_water")], [Lock("o_light")]),
        ([FLOW], [SetNfr("o_water", "flow", 1.0), SetNfr("o_light", "flow", 1.0)]),
        ([Lock(), Unlock()], []),
    ],
)
def test_command_for_all_is_one_for_each_of_those_that_there_are(given, holds):
    asked = Asked()
    for command in given:
        asked.heed(command, ["o_water", "o_light"])
    assert asked.commands == tuple(holds)


def test_locks_go_with_what_they_lock():
    asked = Asked([Pause(), Lock("o_water"), Lock("o_light")])
    assert not asked.settle({"o_water", "o_light"}, ())
    assert asked.settle({"o_light"}, ())
    assert asked.commands == (Pause(), Lock("o_light"))


def test_limits_go_with_their_objectives():
    asked = Asked([FLOW, SetNfr("o_water", "flow", 3.0), SetNfr("o_light", "flow", 4.0)])
    assert not asked.settle((), {"o_water", "o_light"})
    assert asked.settle((), {"o_light"})
    assert asked.commands == (FLOW, SetNfr("o_light", "flow", 4.0))


def test_commands_that_fit_in_one_order_only_are_carried_out_in_that():
    done = []

    def do(command):
        if command.quality == "flow_min" and "flow" not in done:
            raise MapeError("set its other limit first")
        if command.quality == "beauty":
            raise MapeError("there is no beauty")
        done.append(command.quality)

    wanted = [SetNfr("", quality, 1.0) for quality in ("flow_min", "beauty", "flow", "warmth")]
    ((failed, error),) = carry_out(wanted, do)
    assert (failed, str(error)) == (wanted[1], "there is no beauty")
    assert done == ["flow", "warmth", "flow_min"]


def test_it_is_the_same_from_a_parameter():
    asked = Asked([WATER, Pause(), SetNfr("o_water", "flow", 0.1), Lock("o_water")])
    assert Asked.from_parameter(asked.as_parameter()).commands == asked.commands


@pytest.mark.parametrize(
    "value", [None, "pause", 3, {}, [[]], [["pause", "now"]], ["pause"], [["level", "flow", "1"]], [["x"]]]
)
def test_what_can_not_be_read_is_left_out(value):
    assert Asked.from_parameter(value).commands == ()


def test_lock_and_limit_wait_for_an_objective_that_a_task_asks_for_anew():
    lock, limit = Lock("o_water"), SetNfr("o_water", "flow", 3.0)
    asked = Asked([Pause(), lock, limit])
    assert asked.put_off(lock, ["o_light"]) and asked.put_off(limit, ["o_light"])
    assert not asked.settle([], [])
    assert asked.due(["o_light"]) == []
    assert asked.due(["o_light", "o_water"]) == [lock, limit]
    assert asked.due(["o_light", "o_water"]) == []
    assert asked.settle([], [])  # it went again, with its lock and its limit
    assert asked.commands == (Pause(),)


def test_limit_holds_again_once_a_task_has_asked_anew_for_its_objective():
    limit, newer = SetNfr("o_water", "flow", 3.0), SetNfr("o_water", "flow", 4.0)
    asked = Asked([Pause(), Lock("o_water"), limit, SetNfr("o_light", "flow", 3.0)])
    assert asked.asked_anew("o_water") == [limit]
    assert asked.asked_anew("o_water") == []
    assert limit in asked.commands
    assert not asked.wait_no_longer()
    assert asked.asked_anew("o_light") == [], "a task that asks later asks for something else"
    asked = Asked([limit])
    asked.heed(newer)
    assert asked.asked_anew("o_water") == [], "the operator's newer one holds already, or came after the task"
    asked = Asked([limit])
    assert asked.put_off(limit, ["o_light"])
    assert asked.asked_anew("o_water") == [], "it waits for its objective anyway"


def test_what_waits_in_vain_is_forgotten():
    asked = Asked([Pause(), Lock("o_water")])
    assert asked.put_off(Lock("o_water"), [])
    assert asked.wait_no_longer()
    assert asked.commands == (Pause(),)
    assert not asked.wait_no_longer()


def test_only_what_names_an_objective_waits_and_an_operator_may_take_it_back():
    asked = Asked([Lock("o_water")])
    assert (
        not asked.put_off(FLOW, [])
        and not asked.put_off(Pause(), [])
        and not asked.put_off(Lock("o_light"), ["o_light"])
    )
    assert asked.put_off(Lock("o_water"), [])
    asked.heed(Unlock())
    assert asked.due(["o_water"]) == []


def test_only_removals_of_what_a_reasoner_asks_for_from_the_start_are_kept():
    asked = Asked(at_start={"o_light"})
    for i in range(100):  # of tasks or operators, with names of their own
        asked.heed(RemoveObjective(f"o_{i}"))
    asked.heed(RemoveObjective("o_light"))
    assert asked.commands == (RemoveObjective("o_light"),)
    again = Asked.from_parameter([["remove_objective", "o_7"], ["remove_objective", "o_light"]], {"o_light"})
    assert again.commands == asked.commands
