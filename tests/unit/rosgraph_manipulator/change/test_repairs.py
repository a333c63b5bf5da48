"""What is decided about repairs."""

import pytest
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.change.repairs import (
    RETRY_PERIOD,
    RepairedDrivers,
    RepairOutcome,
    RepairsUnderWay,
    may_be_asked,
    may_be_killed,
    told_by_launcher,
    told_by_service,
    why_not_called,
)
from rosgraph_manipulator.configuration.configurations import Configuration, Repair
from std_srvs.srv import EmptyResponse, TriggerResponse

GATE = Configuration("repair_of_gate", "repair_of_gate", "gate.launch")
LAMP = Configuration("repair_of_lamp", "repair_of_lamp", "lamp.launch")


# -- which repairs are under way


@pytest.fixture
def under_way():
    return RepairsUnderWay({name: Repair(name, f"{name}/reset") for name in ("lamp", "gate")})


def test_components_are_repaired_side_by_side(under_way):
    assert (under_way.begin("gate"), under_way.begin("lamp")) == ("", "")


def test_component_is_repaired_once_at_a_time(under_way):
    under_way.begin("gate")
    assert under_way.begin("gate") == "gate is being repaired already: ask again when that has ended"
    under_way.end("gate")
    assert under_way.begin("gate") == ""


def test_unknown_component_is_refused_with_those_that_are_known(under_way):
    assert under_way.begin("door") == "no repair is known for component 'door'; known are: gate, lamp"
    assert RepairsUnderWay({}).begin("door").endswith("known are: none")


# -- services


@pytest.mark.parametrize("kind", ["std_srvs/Trigger", "std_srvs/Empty"])
def test_service_of_either_type_can_repair(kind):
    assert why_not_called("gate", "/gate/reset", kind) == ""


def test_service_that_cannot_repair_is_told_with_the_place():
    assert why_not_called("gate", "/gate/reset", None) == (
        "nobody offers the service /gate/reset: start its node, or correct repairs/gate/service"
    )
    assert why_not_called("gate", "/gate/reset", "std_srvs/SetBool") == (
        "service /gate/reset is of type std_srvs/SetBool, not std_srvs/Trigger or std_srvs/Empty: name another one in "
        "repairs/gate/service"
    )


@pytest.mark.parametrize(
    ("response", "outcome"),
    [
        (EmptyResponse(), RepairOutcome(True, "/gate/reset was called")),
        (TriggerResponse(True, ""), RepairOutcome(True, "/gate/reset was called")),
        (TriggerResponse(True, "it\n moves"), RepairOutcome(True, "/gate/reset was called: it moves")),
        (TriggerResponse(False, "it\n is jammed"), RepairOutcome(False, "/gate/reset has failed: it is jammed")),
        (TriggerResponse(False, ""), RepairOutcome(False, "/gate/reset has failed: it does not say why")),
    ],
)
def test_answer_of_the_service_is_told_in_one_line(response, outcome):
    assert told_by_service("/gate/reset", response) == outcome


# -- drivers


def report(state, change=7, configuration=GATE.name, nodes=("/gate",), message=""):
    return LauncherReport(GATE.function, configuration, change, state, nodes, message=message)


def told(report, missing=(), conflict="", timeout=None):
    return told_by_launcher(report, 7, missing, conflict, timeout)


def test_driver_is_repaired_when_its_nodes_answer():
    assert told(report(STABLE)) == RepairOutcome(True, "started again: /gate")
    assert told(report(STABLE, nodes=())) == RepairOutcome(True, "started again: its nodes have done their work")


@pytest.mark.parametrize("state", [STABLE, RECOVERING])
def test_driver_whose_node_is_missing_is_waited_for(state):
    assert told(report(state), ["/gate"]) is None


def test_driver_that_the_launcher_gives_up_is_not_repaired():
    assert told(report(FAILED, message="too many deaths"), ["/gate"]) == RepairOutcome(False, "too many deaths")


def test_earlier_failure_of_the_driver_does_not_count():
    assert told(report(FAILED, change=6, message="too many deaths"), ["/gate"]) is None


def test_driver_that_is_not_up_in_time_is_told_with_its_nodes_and_who_has_their_name():
    line = "not up within 4 s: node /gate (its name is taken); see their logs"
    assert told(report(STABLE), ["/gate"], " (its name is taken)", timeout=4.0) == RepairOutcome(False, line)
    line = "not up within 4 s: nodes /gate, /lamp; see their logs"
    assert told(None, ["/gate", "/lamp"], timeout=4.0) == RepairOutcome(False, line)


def test_driver_that_is_up_in_the_last_moment_is_repaired():
    assert told(report(STABLE), timeout=4.0).ok


# -- drivers that run since a repair


class Launcher:
    """What a launcher reports."""

    def __init__(self, *reports):
        self.take(*reports)

    def take(self, *reports):
        self.reports = {report.function: report for report in reports}

    def report(self, function):
        return self.reports.get(function, LauncherReport(function))


def drivers(launcher):
    return RepairedDrivers([GATE, LAMP], launcher.report)


def test_driver_that_has_ended_with_its_launcher_is_started_again():
    launcher = Launcher()
    repaired = drivers(launcher)
    repaired.started(GATE)
    launcher.take(report(STABLE))
    assert repaired.lost(0.0) == []
    launcher.take()
    assert repaired.lost(0.0) == [GATE]
    repaired.tried(GATE, 0.0)
    launcher.take(report(STABLE))
    assert repaired.lost(9.0) == []


def test_lost_driver_that_can_not_be_started_is_tried_again_after_a_while():
    repaired = drivers(launcher := Launcher(report(STABLE)))
    launcher.take()
    for now in (0.0, RETRY_PERIOD):
        assert repaired.lost(now) == [GATE]
        repaired.tried(GATE, now)
        assert repaired.lost(now + RETRY_PERIOD / 2) == []


def test_driver_of_an_earlier_manipulators_repair_is_started_again_too():
    launcher = Launcher(report(STABLE))
    repaired = drivers(launcher)
    launcher.take()
    assert repaired.lost(0.0) == [GATE]


@pytest.mark.parametrize("state", [CHANGING, RECOVERING])
def test_driver_that_is_being_started_is_not_lost(state):
    repaired = drivers(launcher := Launcher(report(STABLE)))
    launcher.take(report(state, configuration="" if state == CHANGING else GATE.name))
    assert repaired.lost(0.0) == []


def test_driver_that_was_never_repaired_is_not_started():
    assert drivers(Launcher()).lost(0.0) == []
    assert drivers(Launcher(report(FAILED))).lost(0.0) == []


def test_driver_that_was_given_up_just_now_is_not_lost():
    repaired = drivers(launcher := Launcher(report(STABLE)))
    launcher.take(failed := report(FAILED, message="too many deaths"))
    assert repaired.lost(0.0) == []
    assert repaired.given_up() == [failed]


def test_nothing_is_lost_before_the_launcher_has_reported():
    repaired = RepairedDrivers([GATE], lambda _function: None)
    repaired.started(GATE)
    assert repaired.lost(0.0) == []


def test_driver_that_is_given_up_is_told_once_and_not_started_again():
    repaired = drivers(launcher := Launcher(report(STABLE)))
    failed = report(FAILED, message="too many deaths")
    launcher.take(failed)
    assert repaired.given_up() == [failed]
    assert repaired.given_up() == []
    launcher.take()
    assert repaired.lost(0.0) == []


# -- nodes that somebody else has started


@pytest.mark.parametrize(
    ("words", "asked", "killed"),
    [
        (["python3", "driver.py", "__name:=gate", "__log:=x"], True, True),
        (["python3", "driver.py"], True, False),  # as by rosrun: nothing says that it is another one
        ([], True, False),  # it runs elsewhere
        (["python3", "driver.py", "__name:=lamp"], False, False),  # it got the address of a node that has died
        (["python3", "driver.py", "__name:=gates"], False, False),
        (["env", "__name:=lamp", "driver", "__name:=gate"], True, True),  # ROS takes the last one
    ],
)
def test_process_is_ended_only_where_it_may_be_the_nodes(words, asked, killed):
    assert (may_be_asked("/yard/gate", words), may_be_killed("/yard/gate", words)) == (asked, killed)
