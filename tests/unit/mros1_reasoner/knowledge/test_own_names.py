"""What the knowledge base makes itself has IRIs of its own, whatever objectives, designs and qualities are called."""

from dataclasses import replace

import hierarchy_helpers
import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from ontology_text import swrl
from reasoner_helpers import OBJECTIVE, application

ARMS = {"left_fast": ("f_arm", 1.0, ()), "fast": ("f_arm_left", 1.0, ())}
FORCES = '<t:QualityAttributeType rdf:about="#force"/><t:QualityAttributeType rdf:about="#left_force"/>'


@pytest.fixture
def engine():
    return RuleEngine()


@pytest.fixture
def arms(load, engine):
    """A knowledge base in which names that are joined by `_` are ambiguous."""
    knowledge_base = load(hierarchy_helpers.model(ARMS, {}, extra=FORCES))
    engine.load(knowledge_base.ontology)
    return knowledge_base


def test_groundings_with_one_name_are_told_apart(arms, engine):
    objectives = Objective("o_arm", "f_arm"), Objective("o_arm_left", "f_arm_left")
    deployed = {"o_arm": "left_fast", "o_arm_left": "fast"}
    found = arms.analyse(Facts(objectives, deployed, broken=frozenset({"o_arm"})), engine).objectives
    assert {name: result.in_error for name, result in found.items()} == {"o_arm": True, "o_arm_left": False}
    assert {arms.grounding(*pair) for pair in deployed.items()} == {"fg_o_arm_left_fast"}  # as diagnostics have it


def test_limits_with_one_name_are_told_apart(arms, engine):
    objectives = Objective("o_arm", "f_arm", {"left_force": 1.0}), Objective("o_arm_left", "f_arm_left", {"force": 3.0})
    deployed = {"o_arm": "left_fast", "o_arm_left": "fast"}
    levels = {("o_arm", "left_force"): 2.0, ("o_arm_left", "force"): 2.0}
    found = arms.analyse(Facts(objectives, deployed, levels), engine).objectives
    assert {name: result.violated for name, result in found.items()} == {"o_arm": ("left_force",), "o_arm_left": ()}


@pytest.mark.parametrize(
    "name", ["fg_o_move_scan_fast", "nfr_o_move_safety", "fg_o_move_scan_fast_safety", "safety_min"]
)
def test_operator_may_give_an_objective_any_name(knowledge_base, engine, name):
    engine.load(knowledge_base.ontology)
    core = Mape(knowledge_base, engine, [OBJECTIVE], Settings(start_grace=0.0))
    core.observe_active(1.0, "f_move", "scan_fast", "STABLE")
    core.operator.set_nfr("o_move", "safety_min", 0.1)
    core.operator.add_objective(Objective(name, "f_move", {"energy": 0.9}))
    core.observe_level(2.0, "safety", 0.3)
    core.step(2.0)
    assert {result.status for result in core.analysis.objectives.values()} == {v.IN_PROGRESS}


def test_names_with_slashes_are_told_apart(load, engine):
    designs = {"b/c": ("f", 1.0, ()), "c": ("f", 0.5, ())}
    knowledge_base = load(hierarchy_helpers.model(designs, {}))
    engine.load(knowledge_base.ontology)
    objectives = Objective("a", "f"), Objective("a/b", "f")
    facts = Facts(objectives, {"a": "b/c", "a/b": "c"}, broken=frozenset({"a"}))
    found = knowledge_base.analyse(facts, engine).objectives
    assert {name: result.in_error for name, result in found.items()} == {"a": True, "a/b": False}


def test_saved_limit_can_be_replaced(engine, tmp_path):
    """Also where rules of the model read levels, so that the analysis has the saved ones, too."""
    (tmp_path / "app.owl").write_text(application())
    (tmp_path / "rules.owl").write_text(swrl("hasQAvalue(?fg, ?m), hasValue(?m, 99) -> fg_status(?fg, 'UPDATABLE')"))
    knowledge_base = read_knowledge_base([tmp_path / "app.owl", tmp_path / "rules.owl"])
    facts = Facts((OBJECTIVE,), {"o_move": "scan_fast"}, {("o_move", "safety"): 0.7})
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, facts)
    again = read_knowledge_base([tmp_path / "saved.owl"])
    assert again.grounding("o_move", "scan_fast") == "fg_o_move_scan_fast"
    engine.load(again.ontology)
    for limit, violated in ((0.6, ("safety",)), (0.8, ()), (0.65, ("safety",))):
        other = replace(OBJECTIVE, limits={**OBJECTIVE.limits, "safety": limit})
        found = again.analyse(replace(facts, objectives=(other,)), engine).objectives
        assert found["o_move"].violated == violated


def test_limits_on_the_other_side_of_bands_are_no_qualities_of_a_saved_model(knowledge_base, tmp_path):
    assert knowledge_base.admit("safety_min")
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, Facts((OBJECTIVE,)))
    assert "safety_min" not in read_knowledge_base([tmp_path / "saved.owl"]).qualities
