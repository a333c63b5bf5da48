"""Functions that require functions, on the model of a dual-arm mobile manipulator that builds a pyramid (D1)."""

import owlready2
import pytest
from hierarchy_helpers import D1, PICK_AND_PLACE, model
from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.pellet.owlready import run_pellet
from reasoner_helpers import value


class Robot:
    """A loop whose decisions are carried out at once, but for designs that do not come up."""

    def __init__(self, core, knowledge_base, broken=()):
        self.core, self.knowledge_base, self.broken, self.now = core, knowledge_base, set(broken), 0.0

    def run(self, seconds=0.0):
        """Let time pass, and carry out what is decided; return (objective, configuration, state) of everything."""
        done, self.now = [], self.now + seconds
        for _ in range(20):
            decisions = self.core.step(self.now)
            for decision in decisions:
                state = decision.state
                if state == DECIDED:
                    ok = decision.to_configuration not in self.broken
                    state = self.core.report(self.now, decision.id, ok, "it did not come up").state
                done.append((decision.objective, decision.to_configuration, state))
            if not decisions:
                due = self.core.due(self.now)
                if due is None or due > self.now + 2.0:
                    return done
                self.now = due
        raise AssertionError(f"it does not come to rest: {done}")

    @property
    def groundings(self):
        return {name: running for name, running in self.core.facts.groundings.items() if name in self.core.objectives}


@pytest.fixture
def make(load, pellet):
    """Return a function that makes a robot that has a model and objectives, and nothing deployed."""

    def make(objectives=(PICK_AND_PLACE,), broken=(), text=None, **settings):
        knowledge_base = load(text or model())
        pellet.load(knowledge_base.ontology)
        core = Mape(knowledge_base, pellet, objectives, Settings(start_grace=0.0, **settings))
        return Robot(core, knowledge_base, broken)

    return make


@pytest.fixture
def one_arm(make):
    """Return a robot on which FD1 runs, with the functions that it requires."""
    robot = make(desired="FD1")
    robot.run()
    return robot


def test_grounding_a_root_grounds_what_it_requires_the_deepest_first(make):
    robot = make(desired="FD1")
    assert robot.run() == [
        ("o_F2", "FD2.1", EXECUTED),
        ("o_F1", "FD1.1", EXECUTED),
        ("o_build", "FD1", EXECUTED),
    ]
    assert robot.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.1"}
    assert robot.core.facts.requires["o_build"] == ("o_F1",)


def test_decision_about_a_requirement_says_what_it_is_for(make):
    core = make(desired="FD1").core
    (decision,) = core.step(0.0)
    assert (decision.trigger, decision.from_configuration) == ("initial", "")
    assert "o_build: no configuration runs: o_F2: nothing -> FD2.1, which FD1 of o_build requires" in (
        decision.explanation
    )


def test_design_without_requirements_is_grounded_alone(make):
    robot = make()
    assert robot.run() == [("o_build", "FD2", EXECUTED)]
    assert set(robot.core.objectives) == {"o_build"}


FIND = Objective("o_find", "F2", {"error": 0.5}, when_required=True)


def test_objective_in_reserve_waits_until_a_design_requires_its_function(make):
    robot = make(objectives=(PICK_AND_PLACE, FIND))
    assert robot.run() == [("o_build", "FD2", EXECUTED)]
    assert set(robot.core.objectives) == {"o_build"}
    assert robot.core.is_in_reserve("error")
    robot.core.observe_component(1.0, "left_arm", "FALSE")
    assert [name for name, _, _ in robot.run(seconds=1.0)] == ["o_find", "o_F1", "o_build"]
    assert not robot.core.is_in_reserve("error")
    robot.core.observe_component(2.0, "left_arm", "RECOVERED")
    robot.run(seconds=60.0)
    assert set(robot.core.objectives) == {"o_build"}
    assert robot.groundings == {"o_build": "FD2"}


def test_limits_of_an_objective_in_reserve_hold_while_its_function_is_required(make):
    robot = make(objectives=(PICK_AND_PLACE, FIND), desired="FD1", violation_window=1.0)
    robot.run()
    for _ in range(8):
        robot.core.observe_level(robot.now, "error", 0.9)
        done = robot.run(seconds=0.5)
        if done:
            break
    assert done[0][:2] == ("o_find", "FD2.2")


def test_model_tells_which_objectives_are_in_reserve(make):
    limit = value("o_find_error", "error", 0.5)
    text = model(
        extra='<t:Objective rdf:about="#o_build"><t:typeF rdf:resource="#F0"/></t:Objective>'
        '<t:Objective rdf:about="#o_find"><t:typeF rdf:resource="#F2"/>'
        f'<t:hasNFR>{limit}</t:hasNFR><t:o_when_required rdf:datatype="&xsd;boolean">true</t:o_when_required>'
        "</t:Objective>".replace("&xsd;", "http://www.w3.org/2001/XMLSchema#")
    )
    robot = make(objectives=(), text=text, desired="FD1")
    assert robot.knowledge_base.objectives == (Objective("o_build", "F0"), FIND)


def test_root_objective_of_the_same_function_takes_the_place_of_one_in_reserve(make):
    robot = make(objectives=(PICK_AND_PLACE, FIND, Objective("o_see", "F2")), desired="FD1")
    robot.run()
    assert set(robot.core.objectives) == {"o_build", "o_F1", "o_see"}


def test_scenario_1_tag_is_not_found_under_the_present_light(one_arm):
    one_arm.core.observe_task(one_arm.now, "F2", True, message="no tag is seen")
    assert one_arm.run() == [("o_F2", "FD2.2", EXECUTED)]
    assert one_arm.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.2"}
    # The light may have changed back.
    assert one_arm.run(seconds=100.0) == [("o_F2", "FD2.1", EXECUTED)]


def test_scenario_2_blocked_arm_makes_the_base_move(make):
    robot = make()
    robot.run()
    robot.core.observe_component(1.0, "left_arm", "FALSE")
    assert robot.run(seconds=1.0) == [
        ("o_F2", "FD2.1", EXECUTED),
        ("o_F1", "FD1.1", EXECUTED),
        ("o_build", "FD1", EXECUTED),
    ]


def test_error_of_a_leaf_climbs_in_the_ontology(one_arm):
    one_arm.core.operator.pause()
    one_arm.core.observe_task(one_arm.now, "o_F2", True)
    one_arm.run(seconds=1.0)
    assert {o.status for o in one_arm.core.analysis.objectives.values()} == {v.IN_ERROR_NFR}


def test_only_when_no_design_of_the_leaf_is_left_the_error_climbs(one_arm):
    for expected in ([("o_F2", "FD2.2", EXECUTED)], [("o_build", "FD2", EXECUTED)]):
        one_arm.core.observe_task(one_arm.now, "o_F2", True)
        assert one_arm.run(seconds=1.0) == expected
    assert set(one_arm.core.objectives) == {"o_build"}, "what FD1 required is released"


def test_decision_that_climbs_names_what_failed_and_what_is_released(one_arm):
    core = one_arm.core
    core.observe_component(1.0, "rgbd", "FALSE")
    (decision,) = core.step(1.0)
    assert (decision.objective, decision.to_configuration) == ("o_build", "FD2")
    assert decision.trigger == "component:rgbd"
    assert decision.reasons[0].rules == "compError, compErrFG, S1a, S6b"
    assert decision.releases == ("o_F1", "o_F2")
    refused = {c.name: c.refused_because for c in decision.candidates}
    assert refused["FD1"] == "requires F1, which no design can provide now"


def test_what_nothing_needs_any_longer_is_released_from_the_top_down_after_the_change(one_arm):
    core = one_arm.core
    assert core.released == ()
    core.observe_component(1.0, "rgbd", "FALSE")
    (decision,) = core.step(1.0)
    assert core.released == (), "what runs is needed until the change is made"
    core.report(1.0, decision.id, True)
    core.step(1.5)
    assert core.released == ("F1", "F2")
    core.report_released("F1")
    core.observe_active(2.0, "F2", "", "")
    assert core.released == ()
    assert set(core.active) == {"F0"}


def test_function_that_is_needed_again_before_its_release_stays(one_arm):
    core = one_arm.core
    core.observe_component(1.0, "rgbd", "FALSE")
    assert one_arm.run(seconds=1.0) == [("o_build", "FD2", EXECUTED)]
    assert core.released == ("F1", "F2")
    core.observe_component(one_arm.now, "rgbd", "TRUE")
    core.observe_component(one_arm.now, "left_arm", "FALSE")
    assert one_arm.run(seconds=1.0)[-1] == ("o_build", "FD1", EXECUTED)
    assert core.released == ()
    assert one_arm.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.1"}


def test_removed_objective_is_released_with_what_it_required(make):
    designs = {**D1, "FD3": ("F3", 0.5, ("F2",))}
    robot = make([PICK_AND_PLACE, Objective("o_look", "F3")], text=model(designs, {}), desired="FD1", broken=["FD2"])
    robot.run(seconds=1.0)
    robot.core.operator.remove_objective("o_build")
    robot.run(seconds=1.0)
    assert robot.core.released == ("F0", "F1"), "o_look still requires F2"


def test_function_that_vanishes_runs_no_more_and_is_deployed_again(one_arm):
    one_arm.core.observe_active(one_arm.now, "F1", "", "")
    one_arm.core.step(one_arm.now)
    assert one_arm.groundings == {"o_build": "FD1", "o_F2": "FD2.1"}
    assert one_arm.core.released == (), "what it requires is still needed"
    assert one_arm.run(seconds=2.0) == [("o_F1", "FD1.1", EXECUTED)]


def test_function_that_never_ran_may_vanish(one_arm):
    one_arm.core.observe_active(one_arm.now, "F7", "", "")
    assert one_arm.run(seconds=2.0) == []


def test_first_deployment_is_known_as_such(make):
    core = make(desired="FD1").core
    (decision,) = core.step(0.0)
    assert core.is_first(decision)
    core.report(0.0, decision.id, True)
    core.observe_task(1.0, "o_F2", True)
    decision = next(d for now in range(1, 20) for d in core.step(float(now)) if d.objective == "o_F2")
    assert not core.is_first(decision)


def test_leaf_that_cannot_be_helped_is_told_once_where_nothing_above_helps(one_arm):
    one_arm.core.observe_component(1.0, "left_arm", "FALSE")
    one_arm.core.observe_component(1.0, "rgbd", "FALSE")
    assert one_arm.run(seconds=1.0) == [("o_F2", "", FAILED)]
    assert one_arm.run(seconds=1.0) == []
    assert one_arm.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.1"}


def test_requirement_that_does_not_come_up_gives_way_to_another_then_to_another_root_design(make):
    robot = make(broken=["FD2.1", "FD2.2"], text=model(components={"left_arm": ("FD2",)}), desired="FD1")
    assert robot.run(seconds=1.0) == [
        ("o_F2", "FD2.1", FAILED),
        ("o_F2", "FD2.2", FAILED),
        ("o_build", "FD2", EXECUTED),
    ]
    assert set(robot.core.objectives) == {"o_build"}


NAVIGATION = {
    "drive": ("F0", 0.9, ("F1",)),
    "beam": ("F0", 0.1, ()),
    "by_laser": ("F1", 0.9, ()),
    "by_wheels": ("F1", 0.5, ()),
}
HOME = [("o_F1", "by_laser", EXECUTED), ("o_build", "drive", EXECUTED)]


def test_component_that_works_again_brings_back_a_design_with_all_that_it_requires(make):
    robot = make(text=model(NAVIGATION, {"laser": ("by_laser",), "wheels": ("by_wheels",)}))
    for component in ("laser", "wheels"):
        robot.core.observe_component(0.0, component, "FALSE")
    assert robot.run() == [("o_build", "beam", EXECUTED)]
    robot.core.observe_component(10.0, "laser", "TRUE")
    assert robot.run(seconds=10.0) == HOME
    assert robot.core.released == ()
    assert robot.run(seconds=200.0) == []


def test_way_to_a_better_design_is_given_up_where_a_requirement_fails(make):
    robot = make(text=model(NAVIGATION, {"laser": ("by_laser",), "wheels": ("by_wheels",)}), broken=["by_laser"])
    for component in ("laser", "wheels"):
        robot.core.observe_component(0.0, component, "FALSE")
    robot.run()
    robot.core.observe_component(10.0, "laser", "TRUE")
    assert robot.run(seconds=10.0) == [("o_F1", "by_laser", FAILED)]
    assert set(robot.core.objectives) == {"o_build"}
    robot.broken.clear()
    assert robot.run(seconds=100.0) == HOME


def test_what_failed_below_is_tried_again_after_the_error_has_climbed(make):
    robot = make(text=model(NAVIGATION, {}))
    assert robot.run() == HOME
    robot.broken = {"by_laser", "by_wheels"}
    robot.core.observe_active(1.0, "F1", "by_laser", "FAILED")
    assert robot.run(seconds=1.0) == [("o_F1", "by_wheels", FAILED), ("o_build", "beam", EXECUTED)]
    assert robot.run(seconds=30.0) == []
    robot.broken.clear()
    assert robot.run(seconds=60.0) == HOME


def test_chance_is_kept_while_a_change_is_going_on(make):
    robot = make(text=model(NAVIGATION, {"laser": ("by_laser",), "wheels": ("by_wheels",)}))
    for component in ("laser", "wheels"):
        robot.core.observe_component(0.0, component, "FALSE")
    robot.run()
    robot.core.observe_active(10.0, "F0", "beam", "RECONFIGURING")
    robot.core.observe_component(10.0, "laser", "TRUE")
    assert robot.run(seconds=10.0) == []
    robot.core.observe_active(20.0, "F0", "beam", "STABLE")
    assert robot.run(seconds=10.0) == HOME


def test_root_in_trouble_itself_goes_before_its_leaf(one_arm):
    one_arm.core.observe_task(one_arm.now, "o_F2", True)
    one_arm.core.observe_component(1.0, "base", "FALSE")
    assert one_arm.run(seconds=1.0) == [("o_build", "FD2", EXECUTED)]


def test_failed_task_of_a_root_objective_is_a_violation(make):
    robot = make()
    robot.run()
    robot.core.observe_task(3.0, "", True, stamp=2.5, message="goal aborted")
    (decision,) = robot.core.step(3.0)
    assert decision.trigger == "task:o_build"
    assert decision.causes == ("the task failed: goal aborted",)
    assert decision.stamp_monitored == 2.5
    assert robot.core.analysis.objectives["o_build"].status == v.IN_ERROR_NFR
    assert decision.to_configuration == "FD2.1"


def test_failed_task_is_forgotten_when_it_goes_on(one_arm):
    one_arm.core.observe_task(one_arm.now, "o_build", True)
    one_arm.core.observe_task(one_arm.now, "o_build", False)
    assert one_arm.run(seconds=1.0) == []


def test_task_that_nobody_knows_is_refused(make):
    core = make().core
    with pytest.raises(MapeError, match="known: o_build"):
        core.observe_task(1.0, "o_fly", True)
    with pytest.raises(MapeError, match="nothing is deployed for it"):
        core.observe_task(1.0, "o_build", True)


def test_several_roots_are_served_and_share_what_they_require(make):
    designs = {**D1, "FD3": ("F3", 0.5, ("F2",))}
    robot = make([PICK_AND_PLACE, Objective("o_look", "F3")], text=model(designs, {}), broken=["FD2"])
    done = robot.run(seconds=1.0)
    assert ("o_look", "FD3", EXECUTED) in done
    assert [entry for entry in done if entry[0] == "o_F2"] == [("o_F2", "FD2.1", EXECUTED)]
    assert robot.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.1", "o_look": "FD3"}
    robot.core.operator.remove_objective("o_look")
    robot.run(seconds=1.0)
    assert set(robot.core.objectives) == {"o_build", "o_F1", "o_F2"}
    robot.core.operator.remove_objective("o_build")
    robot.run(seconds=1.0)
    assert robot.core.objectives == {}


def test_root_objective_that_another_root_requires_stays_when_that_one_lets_go(make):
    robot = make([PICK_AND_PLACE, Objective("o_see", "F2", {"error": 0.5})], desired="FD1")
    robot.run()
    assert set(robot.core.objectives) == {"o_build", "o_F1", "o_see"}
    robot.core.observe_component(1.0, "base", "FALSE")
    assert robot.run(seconds=1.0) == [("o_build", "FD2", EXECUTED)]
    assert robot.groundings == {"o_build": "FD2", "o_see": "FD2.1"}


def test_what_runs_at_the_start_is_taken_over_with_everything_it_requires(make):
    robot = make()
    for function, design in (("F2", "FD2.2"), ("F0", "FD1"), ("F1", "FD1.1")):
        robot.core.observe_active(0.0, function, design, "STABLE")
    assert robot.run() == []
    assert robot.groundings == {"o_build": "FD1", "o_F1": "FD1.1", "o_F2": "FD2.2"}


def test_requirement_that_nobody_has_deployed_is_grounded(make):
    robot = make()
    robot.core.observe_active(0.0, "F0", "FD1", "STABLE")
    assert robot.run() == [("o_F2", "FD2.1", EXECUTED), ("o_F1", "FD1.1", EXECUTED)]


def test_locked_requirement_keeps_the_root_as_it_is(one_arm):
    one_arm.core.operator.lock("o_F2")
    one_arm.core.observe_task(one_arm.now, "o_F2", True)
    assert one_arm.run(seconds=1.0) == [("o_F2", "", FAILED)]
    one_arm.core.operator.unlock("o_F2")
    assert one_arm.run(seconds=1.0) == [("o_F2", "FD2.2", EXECUTED)]


def test_violated_limit_of_a_root_is_not_blamed_on_its_requirements(make):
    robot = make([Objective("o_build", "F0", {"error": 0.5})], desired="FD1", cool_down=5.0)
    robot.run()
    done = []
    for now in (10.0, 11.0, 12.0):
        robot.core.observe_level(now, "error", 0.9, "fg_o_build_FD1")
        done += robot.run(seconds=now - robot.now)
    assert done == [("o_build", "FD2", EXECUTED)]


def test_feasible_heeds_requirements(make):
    core = make().core
    core.step(0.0)
    assert core.feasible() == {"F0": ("FD2", "FD1"), "F1": ("FD1.1",), "F2": ("FD2.1", "FD2.2")}
    core.observe_component(1.0, "rgbd", "FALSE")
    assert core.feasible() == {"F0": ("FD2",), "F1": (), "F2": ()}


def test_saved_knowledge_base_says_what_can_be_deployed_as_feasible_does(make, tmp_path):
    robot = make()
    for component in ("rgbd", "left_arm"):
        robot.core.observe_component(0.0, component, "FALSE")
    robot.run()
    assert robot.core.feasible() == {"F0": (), "F1": (), "F2": ()}
    world = robot.knowledge_base.world(robot.core.known)  # without what the node concluded
    run_pellet(world)
    told = {name: world[f"http://example.org/app#{name}"].fd_realisability for name in D1}
    assert all(values == [False] for values in told.values())


def test_function_of_which_one_design_is_left_can_be_fulfilled(make):
    designs = {**D1, "FD2.3": ("F2", 0.1, ())}
    core = make(text=model(designs)).core
    core.observe_component(0.0, "rgbd", "FALSE")
    core.step(0.0)
    assert core.feasible() == {"F0": ("FD2", "FD1"), "F1": ("FD1.1",), "F2": ("FD2.3",)}


def test_function_that_no_design_solves_keeps_those_that_require_it_from_being_deployed(make):
    text = model(extra='<t:Function rdf:about="#F9"/>').replace(
        'requiresF rdf:resource="#F2"', 'requiresF rdf:resource="#F9"'
    )
    core = make(text=text).core
    core.step(0.0)
    assert core.feasible()["F0"] == ("FD2",)
    assert set(core.analysis.unrealisable) == {"FD1", "FD1.1"}


def test_saved_knowledge_base_holds_what_has_failed(make, tmp_path):
    robot = make(broken=("FD2",))
    robot.run()
    save_knowledge_base(tmp_path / "saved.owl", robot.knowledge_base, robot.core.known, robot.core.analysis)
    world = owlready2.World()
    saved = world.get_ontology((tmp_path / "saved.owl").as_uri()).load()
    design, objective = saved.search_one(iri="*#FD2"), saved.search_one(iri="*#o_build")
    assert list(design.fd_error_log) == [objective]


def test_saved_knowledge_base_asks_for_the_root_only(one_arm, tmp_path):
    one_arm.core.observe_task(one_arm.now, "o_F2", True)
    one_arm.core.operator.pause()
    one_arm.run(seconds=1.0)
    save_knowledge_base(tmp_path / "saved.owl", one_arm.knowledge_base, one_arm.core.facts, one_arm.core.analysis)
    again = read_knowledge_base([tmp_path / "saved.owl"])
    assert again.objectives == (PICK_AND_PLACE,)
    assert again.designs["FD1"].requires == ("F1",)
    text = (tmp_path / "saved.owl").read_text()
    assert "requiresO" in text
    assert "IN_ERROR_NFR" in text


def test_requirement_whose_configuration_has_failed_before_is_replaced_when_it_is_needed(make):
    robot = make()
    robot.core.observe_active(0.0, "F2", "FD2.1", "FAILED")
    robot.core.observe_active(0.0, "F0", "FD1", "STABLE")
    robot.core.observe_active(0.0, "F1", "FD1.1", "STABLE")
    (decision,) = robot.core.step(5.0)
    assert (decision.objective, decision.trigger, decision.to_configuration) == ("o_F2", "component:FD2.1", "FD2.2")
    assert decision.stamp_monitored == 5.0


def test_locked_requirement_is_not_released_by_a_change_above(one_arm):
    one_arm.core.operator.lock("o_F2")
    one_arm.core.observe_component(1.0, "rgbd", "FALSE")
    assert one_arm.run(seconds=1.0) == [("o_F2", "", FAILED)]
    one_arm.core.operator.unlock("o_F2")
    assert one_arm.run(seconds=1.0) == [("o_build", "FD2", EXECUTED)]


@pytest.mark.parametrize("gone", [("F0",), ("F0", "F1", "F2")])
def test_what_a_vanished_root_has_required_runs_on_under_a_lock(one_arm, gone):
    one_arm.core.operator.lock("")
    for function in gone:
        one_arm.core.observe_active(one_arm.now, function, "", "")
    one_arm.run(seconds=20.0)
    assert one_arm.core.released == ()
    assert one_arm.core.view.locked == {"o_build", "o_F1", "o_F2"}


def test_what_a_root_requires_runs_on_while_the_root_is_waited_for_at_the_start(load, pellet):
    knowledge_base = load(model())
    pellet.load(knowledge_base.ontology)
    core = Mape(knowledge_base, pellet, [PICK_AND_PLACE], Settings(start_grace=15.0))
    for function, design in (("F0", "FD1"), ("F1", "FD1.1"), ("F2", "FD2.1")):
        core.observe_active(1.0, function, design, "STABLE")
    core.step(1.0)
    core.observe_active(2.0, "F0", "", "")
    assert core.step(2.0) == core.step(2.5) == []
    assert core.released == ()


def test_change_of_a_root_does_not_release_a_locked_requirement(one_arm):
    one_arm.core.operator.lock("o_F2")
    one_arm.core.observe_task(one_arm.now, "o_build", True)
    assert one_arm.run(seconds=1.0) == [("o_build", "", FAILED)]
    assert one_arm.core.released == ()
    one_arm.core.operator.unlock("o_F2")
    assert one_arm.run(seconds=1.0) == [("o_build", "FD2", EXECUTED)]


def test_lock_stays_when_somebody_else_takes_what_it_locks_away(one_arm):
    one_arm.core.operator.lock("o_F2")
    one_arm.core.observe_active(one_arm.now, "F0", "FD2", "STABLE")
    one_arm.run(seconds=1.0)
    assert "o_F2" not in one_arm.core.objectives
    assert one_arm.core.view.locked == {"o_F2"}


def test_locks_end_with_the_objective_that_is_asked_for_no_longer(one_arm):
    one_arm.core.operator.lock("")
    one_arm.core.operator.remove_objective("o_build")
    assert not one_arm.core.view.locked


def test_limit_of_a_requirement_holds_when_it_goes_and_comes_back(one_arm):
    one_arm.core.operator.set_nfr("o_F2", "error", 0.3)
    assert one_arm.core.objectives["o_F2"].limits == {"error": 0.3}
    one_arm.core.observe_active(one_arm.now, "F0", "FD2", "STABLE")
    one_arm.run(seconds=1.0)
    assert "o_F2" not in one_arm.core.objectives
    one_arm.core.observe_active(one_arm.now, "F0", "FD1", "STABLE")
    one_arm.run(seconds=1.0)
    assert one_arm.core.objectives["o_F2"].limits == {"error": 0.3}


@pytest.mark.parametrize("state", ["RECONFIGURING", "RECOVERING"])
def test_objective_waits_for_what_its_function_does_when_it_comes_into_being(make, state):
    robot = make()
    robot.now = 100.0
    for function, design, how in (("F0", "FD1", "STABLE"), ("F1", "FD1.1", "STABLE"), ("F2", "FD2.1", state)):
        robot.core.observe_active(90.0, function, design, how)
    robot.run()
    view, running = robot.core.view, robot.core.view.running["o_F2"]
    assert view.is_busy(running, 149.0) and not view.is_busy(running, 151.0)
    robot.core.observe_active(101.0, "F2", "FD2.1", "STABLE")
    assert not view.is_busy(view.running["o_F2"], 101.0)
