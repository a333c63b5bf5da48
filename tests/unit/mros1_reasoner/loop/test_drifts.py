"""Parameters of what runs that somebody has changed: they are put back, but not again and again."""

import pytest
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import DriftFact, Entry
from mros1_reasoner.loop.journal import apply
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import application

PICK = Objective("o_pick", "f_pick", {"safety": 0.6})
DESIGNS = {
    "by_eye": ({"performance": 1.0, "safety": 0.3}, ["eye"]),
    "by_touch": ({"performance": 0.5, "safety": 0.3}, []),
}
GRIPPER = "arm/gripper"


class Cell:
    """A loop beside a manipulator that carries out what is decided, and parameters that somebody may change."""

    def __init__(self, core):
        self.core, self.now, self.told = core, 0.0, []
        self.drifted = {}  # parameters, by node
        self.disturbed = set()  # nodes whose parameters somebody changes again at once when they were put back
        self.repairs_fail = False
        self.core.observe_active(0.0, "f_pick", "by_eye", "STABLE")

    def run(self, seconds):
        """Let time pass; return what was decided and refused: state, configuration."""
        before = len(self.told)
        end = self.now + seconds
        while self.now < end:
            self.now += 0.1
            for node, parameters in self.drifted.items():
                self.core.observe_drift(self.now, node, parameters, ["by_eye"], self.now)
            for decision in self.core.step(self.now):
                self.told.append(decision)
                if decision.state == DECIDED:
                    self.carry_out(decision)
        return [(decision.state, decision.to_configuration) for decision in self.told[before:]]

    def carry_out(self, decision):
        for state in ("RECONFIGURING", "STABLE"):
            self.now += 0.1
            self.core.observe_active(self.now, "f_pick", decision.to_configuration, state)
        if not self.repairs_fail:
            self.drifted = {node: names for node, names in self.drifted.items() if node in self.disturbed}
        done = self.core.report(self.now, decision.id, not self.repairs_fail, "" if not self.repairs_fail else "no way")
        assert done.state == (FAILED if self.repairs_fail else EXECUTED)


@pytest.fixture
def make(load, pellet):
    def make(**settings):
        gripper = '<t:Component rdf:about="#arm/gripper"><m:deployedBy rdf:resource="#by_eye"/></t:Component>'
        knowledge_base = load(application(DESIGNS, gripper, "f_pick"))
        pellet.load(knowledge_base.ontology)
        return Cell(Mape(knowledge_base, pellet, [PICK], Settings(start_grace=0.0, **settings)))

    return make


@pytest.fixture
def cell(make):
    cell = make()
    assert cell.run(5.0) == []
    return cell


AGAIN = (DECIDED, "by_eye")
LEFT = (FAILED, "")


def test_drifted_parameters_have_the_design_deployed_again_once(cell):
    cell.drifted = {GRIPPER: "force,speed"}
    assert cell.run(60.0) == [AGAIN]
    (decision,) = cell.told
    assert decision.trigger == "parameter:arm/gripper"
    assert decision.causes == ("parameters of node arm/gripper of by_eye have drifted: force,speed",)
    assert "by_eye -> by_eye, with its parameters put back: by_eye is deployed again" in decision.explanation
    assert cell.core.nodes_to_restart(decision) == ()
    assert cell.core.analysis.objectives["o_pick"].status == "IN_PROGRESS"


def test_parameters_of_the_system_are_put_back_too(cell):
    cell.drifted = {"ROS Graph": "site"}
    assert cell.run(10.0) == [AGAIN]
    assert cell.told[0].causes == ("parameters of the system have drifted: site",)


def test_parameters_that_drift_again_and_again_are_left_and_that_is_told_once(cell):
    cell.drifted, cell.disturbed = {GRIPPER: "force"}, {GRIPPER}
    assert cell.run(600.0) == [AGAIN, AGAIN, LEFT]
    refusal = cell.told[-1]
    assert "have drifted again after they were put back 2 times: force" in refusal.causes[0]
    assert "find out who does" in refusal.explanation
    assert not refusal.degraded


def test_parameters_that_were_left_are_put_back_again_after_they_were_right(cell):
    cell.drifted, cell.disturbed = {GRIPPER: "force"}, {GRIPPER}
    cell.run(200.0)
    cell.drifted, cell.disturbed = {}, set()
    assert cell.run(100.0) == []
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(30.0) == [AGAIN]


def test_parameters_that_drift_now_and_then_are_put_back_each_time(cell):
    for _ in range(5):
        cell.drifted = {GRIPPER: "force"}
        assert cell.run(65.0) == [AGAIN]


def test_repairs_of_long_ago_are_forgotten_but_those_of_the_last_minute_count(cell):
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(40.0) == [AGAIN]
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(25.0) == [AGAIN]  # the first one is then more than a minute ago
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(10.0) == [AGAIN]
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(10.0) == [LEFT]


def test_other_nodes_are_put_back_while_those_of_one_are_left(cell):
    cell.drifted, cell.disturbed = {GRIPPER: "force"}, {GRIPPER}
    assert cell.run(30.0) == [AGAIN, AGAIN, LEFT]
    cell.drifted["arm/lamp"] = "power"
    assert cell.run(30.0) == [AGAIN, LEFT]
    assert cell.drifted == {GRIPPER: "force"}


def test_repair_that_fails_blames_no_design_and_is_not_tried_for_ever(cell):
    cell.drifted, cell.repairs_fail = {GRIPPER: "force"}, True
    told = cell.run(300.0)
    assert told == [AGAIN, AGAIN, LEFT]


def test_drift_of_what_does_not_run_is_left_out(cell):
    cell.core.observe_drift(cell.now, "picker", "force", ["by_touch"])
    assert cell.run(5.0) == []


def test_late_report_after_a_change_by_somebody_else_does_not_count(cell):
    cell.core.observe_active(cell.now, "f_pick", "by_eye", "RECONFIGURING")
    cell.core.observe_drift(cell.now, GRIPPER, "force", ["by_eye"])
    cell.core.observe_active(cell.now + 0.1, "f_pick", "by_eye", "STABLE")
    cell.core.observe_drift(cell.now + 0.2, GRIPPER, "force", ["by_eye"])
    assert cell.run(20.0) == []


def test_locked_paused_and_watching_loops_put_nothing_back(make):
    for settings, command in (({}, "lock"), ({}, "pause"), ({"dry_run": True}, None)):
        cell = make(**settings)
        if command:
            getattr(cell.core.operator, command)(*[""] * (command == "lock"))
        cell.drifted = {GRIPPER: "force"}
        assert AGAIN not in cell.run(30.0), command
        assert len(cell.told) <= 1, command


def test_drift_beside_a_violated_limit_leads_to_what_the_limit_asks_for(make):
    cell = make(violation_window=1.0, correct_expected=False)
    cell.run(1.0)
    cell.drifted = {GRIPPER: "force"}
    for _ in range(100):
        cell.core.observe_level(cell.now, "safety", 0.9)
        cell.run(0.1)
    assert (DECIDED, "by_touch") in [(decision.state, decision.to_configuration) for decision in cell.told]


def test_shared_node_is_put_back_once(make, load, pellet):
    other = Objective("o_look", "f_pick")
    knowledge_base = load(application(DESIGNS, "", "f_pick"))
    pellet.load(knowledge_base.ontology)
    cell = Cell(Mape(knowledge_base, pellet, [PICK, other], Settings(start_grace=0.0)))
    cell.run(5.0)
    cell.drifted = {"camera": "rate"}
    assert cell.run(20.0) == [AGAIN]


def test_status_is_read_with_the_configurations_and_without_them_left_out():
    def status(*values):
        pairs = [type("V", (), {"key": key, "value": value}) for key, value in values]
        return type(
            "S", (), {"message": "Wrong param configuration", "name": "arm/gripper", "level": 2, "values": pairs}
        )

    wrong = [("force", "5"), ("speed", "2"), ("expected/force", "1"), ("expected/speed", "3")]
    reader = DiagnosticsReader((), ())
    assert reader.read([status(*wrong)]).facts == ()
    (fact,) = reader.read([status(*wrong, ("in configuration", "a"), ("in configuration", "b"))], 7.0).facts
    assert fact == DriftFact("arm/gripper", "force,speed", "a,b", 7.0)


def test_journal_has_drifts(cell):
    apply(cell.core, Entry(cell.now, DriftFact(GRIPPER, "force", "by_touch,by_eye", 1.5)))
    (decision,) = cell.core.step(cell.now)
    assert (decision.trigger, decision.stamp_monitored) == ("parameter:arm/gripper", 1.5)


def test_parameters_are_put_back_though_the_design_has_failed_before(make):
    """Another design would fit, but a drift alone is no reason for it."""
    cell = make()
    cell.run(1.0)
    cell.core._state.note_in_vain(cell.now, "by_eye", "o_pick", "dropped what it held")
    cell.drifted = {GRIPPER: "force"}
    assert cell.run(5.0) == [(DECIDED, "by_eye")]
    assert "with its parameters put back" in cell.told[-1].explanation
