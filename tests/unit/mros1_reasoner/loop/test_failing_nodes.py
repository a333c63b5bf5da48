"""Nodes of what runs for a function that hang or die: the design is deployed again, then another one."""

import pytest
from hierarchy_helpers import D1, PICK_AND_PLACE, model
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from reasoner_helpers import application

PICK = Objective("o_pick", "f_pick")
DESIGNS = {
    "by_eye": ({"performance": 1.0}, ["eye"]),
    "by_touch": ({"performance": 0.5}, []),
}
PICKER = (
    '<t:Component rdf:about="#picker"><m:deployedBy rdf:resource="#by_eye"/><m:deployedBy rdf:resource="#by_touch"/>'
    '</t:Component><t:Component rdf:about="#arm/lamp"><m:deployedBy rdf:resource="#by_eye"/></t:Component>'
)


class Cell:
    """A loop whose decisions are carried out at once; some nodes hang again a while after each start."""

    def __init__(self, core, period=3.0):
        self.core, self.now, self.period, self.hanging = core, 0.0, period, set()
        self.done = []

    def run(self, seconds):
        """Let time pass; return what was decided: moment, objective, configuration, restarted nodes."""
        end, before = self.now + seconds, len(self.done)
        while self.now < end:
            self.now += 0.1
            for node in self.hanging:
                last = self.done[-1][0] if self.done else -self.period
                status = "FALSE" if self.now - last >= self.period else "TRUE"
                self.core.observe_component(self.now, node, status, self.now)
            for decision in self.core.step(self.now):
                if decision.state == DECIDED:
                    nodes = self.core.nodes_to_restart(decision)
                    self.core.report(self.now, decision.id, True)
                    self.done.append((self.now, decision.objective, decision.to_configuration, nodes))
        return [entry[1:] for entry in self.done[before:]]


@pytest.fixture
def make(load, pellet):
    def make(objectives=(PICK,), text=None, **settings):
        knowledge_base = load(text or application(DESIGNS, PICKER, "f_pick"))
        pellet.load(knowledge_base.ontology)
        return Mape(knowledge_base, pellet, objectives, Settings(start_grace=0.0, **settings))

    return make


@pytest.fixture
def cell(make):
    """Return a cell in which by_eye runs."""
    cell = Cell(make())
    cell.core.observe_active(0.0, "f_pick", "by_eye", "STABLE")
    assert cell.run(5.0) == []
    return cell


def test_nodes_of_designs_are_components_that_no_design_requires(load):
    knowledge_base = load(application(DESIGNS, PICKER, "f_pick"))
    assert knowledge_base.components == {"eye", "picker", "arm/lamp"}
    assert knowledge_base.own_nodes == {"picker", "arm/lamp"}
    assert knowledge_base.designs["by_eye"].nodes == {"picker", "arm/lamp"}
    assert knowledge_base.designs["by_eye"].components == {"eye"}
    reader = DiagnosticsReader(knowledge_base.qualities, knowledge_base.components)
    status = type("S", (), {"message": "Missing node", "name": "arm/lamp", "level": 2, "values": (), "hardware_id": ""})
    assert [fact.component for fact in reader.read([status]).facts] == ["arm/lamp"]


def test_hung_node_has_its_design_deployed_again_once(cell):
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    (decision,) = cell.core.step(cell.now)
    assert (decision.from_configuration, decision.to_configuration) == ("by_eye", "by_eye")
    assert decision.trigger == "component:picker"
    assert decision.causes == ("node picker of by_eye does not work",)
    assert "with picker started anew" in decision.explanation
    assert cell.core.nodes_to_restart(decision) == ("picker",)
    assert cell.core.analysis.objectives["o_pick"].status == "IN_ERROR_COMPONENT"
    assert cell.core.analysis.unrealisable == {}
    cell.core.report(cell.now, decision.id, True)
    assert cell.run(30.0) == []
    assert cell.core.analysis.objectives["o_pick"].status == "IN_PROGRESS"


def test_node_that_fails_again_and_again_leads_to_another_design(cell):
    cell.hanging = {"arm/lamp"}
    again = ("o_pick", "by_eye", ("arm/lamp",))
    assert cell.run(40.0) == [again, again, ("o_pick", "by_touch", ())]


def test_node_of_every_design_never_ends_the_attempts(cell):
    cell.hanging = {"picker"}
    done = cell.run(300.0)
    assert done[:3] == [("o_pick", "by_eye", ("picker",))] * 2 + [("o_pick", "by_touch", ("picker",))]
    assert {design for _, design, _ in done[-8:]} == {"by_eye", "by_touch"}
    assert len(done) < 60, "attempts are spaced"
    assert cell.core.analysis.unrealisable == {}
    cell.hanging = set()
    cell.core.observe_component(cell.now, "picker", "TRUE", cell.now)
    cell.run(40.0)
    assert cell.run(60.0) == []


def test_only_design_is_deployed_again_and_again_with_growing_waits(make):
    picker = '<t:Component rdf:about="#picker"><m:deployedBy rdf:resource="#by_touch"/></t:Component>'
    cell = Cell(make(text=application({"by_touch": DESIGNS["by_touch"]}, picker, "f_pick")), period=1.0)
    cell.hanging = {"picker"}
    cell.core.observe_active(0.0, "f_pick", "by_touch", "STABLE")
    done = cell.run(200.0)
    assert set(done) == {("o_pick", "by_touch", ("picker",))}
    waits = [after[0] - before[0] for before, after in zip(cell.done, cell.done[1:], strict=False)]
    assert waits[0] < 4.0
    assert max(waits) > 16.0


def test_late_report_of_the_former_node_is_not_held_against_the_new_one(cell):
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    (decision,) = cell.core.step(cell.now)
    cell.core.report(cell.now, decision.id, True)
    cell.core.observe_component(cell.now + 0.1, "picker", "FALSE", cell.now)
    assert cell.run(1.5) == []
    cell.core.observe_component(cell.now, "picker", "RECOVERED", cell.now)
    assert cell.run(30.0) == []


def test_failed_driver_and_hung_node_lead_to_another_design_with_the_node_started_anew(cell):
    cell.core.observe_component(cell.now, "eye", "FALSE", cell.now)
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    assert cell.run(1.0) == [("o_pick", "by_touch", ("picker",))]


def test_restart_that_fails_leads_to_another_design(cell):
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    (decision,) = cell.core.step(cell.now)
    cell.core.report(cell.now, decision.id, False, "picker did not come up")
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    assert cell.run(3.0) == [("o_pick", "by_touch", ("picker",))]


def test_nodes_are_left_to_a_manipulator_that_restarts_them(cell):
    cell.core.observe_active(cell.now, "f_pick", "by_eye", "RECOVERING")
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now)
    assert cell.run(5.0) == []
    cell.core.observe_active(cell.now, "f_pick", "by_eye", "STABLE")
    cell.core.observe_component(cell.now, "picker", "TRUE", cell.now)
    assert cell.run(5.0) == []


def test_hung_node_of_a_requirement_is_restarted_without_a_change_above(make):
    text = model(extra='<t:Component rdf:about="#finder"><m:deployedBy rdf:resource="#FD2.1"/></t:Component>')
    robot = Cell(make((PICK_AND_PLACE,), text, desired="FD1"))
    robot.run(5.0)
    assert [design for _, _, design, _ in robot.done] == ["FD2.1", "FD1.1", "FD1"]
    assert set(D1) >= {"FD2.2"}
    robot.core.observe_component(robot.now, "finder", "FALSE", robot.now)
    assert robot.run(10.0) == [("o_F2", "FD2.1", ("finder",))]


def test_decision_says_why_a_node_or_a_component_does_not_work(cell):
    cell.core.observe_component(cell.now, "eye", "FALSE", cell.now, "node camera: dead")
    cell.core.observe_component(cell.now, "eye", "FALSE", cell.now)  # a reader that knows no reason
    (decision,) = cell.core.step(cell.now)
    assert decision.causes == ("component eye, which by_eye requires, does not work (node camera: dead)",)
    assert decision.explanation.startswith(f"o_pick: {decision.causes[0]}: by_eye -> by_touch")
    cell.core.report(cell.now, decision.id, True)
    cell.now += 5.0
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now, "hung")
    cell.core.observe_component(cell.now, "picker", "FALSE", cell.now + 0.1, "ended")
    (decision,) = cell.core.step(cell.now + 0.2)
    assert decision.causes == ("node picker of by_touch does not work (ended)",)
    assert decision.stamp_monitored == cell.now
