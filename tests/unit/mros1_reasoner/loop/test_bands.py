"""Objectives with two limits of one quality, and objectives with different limits of it."""

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from node_kit.parameters import ParameterError
from ontology_text import APP, assertion, typed

LEVELS = {"slow": (30.0, 0.3), "brisk": (50.0, 0.6), "fast": (90.0, 1.0)}
SETTINGS = Settings(history=1, violation_window=0.0, cool_down=0.0, correct_expected=False, relief=0.0)


def quality_value(name, quality, level, operator=""):
    text = typed(APP + name, v.QA_VALUE) + assertion(APP + name, v.IS_QA_TYPE, APP + quality)
    text += assertion(APP + name, v.HAS_VALUE, level, v.XSD + "decimal")
    return text + (assertion(APP + name, v.NFR_COMPARISON_OPERATOR, operator, v.XSD + "string") if operator else "")


def model(limits=(), sign="1"):
    """Return designs of one function at different temperatures, and an objective with limits (level, operator)."""
    text = typed(APP + "f_dry", v.FUNCTION) + typed(APP + "o_dry", v.OBJECTIVE)
    text += assertion(APP + "o_dry", v.TYPE_F, APP + "f_dry")
    text += "".join(typed(APP + quality, v.QA_TYPE) for quality in ("heat", "performance"))
    text += assertion(APP + "heat", v.QA_SIGN, sign, v.XSD + "decimal")
    for name, (heat, performance) in LEVELS.items():
        text += typed(APP + name, v.FUNCTION_DESIGN) + assertion(APP + name, v.SOLVES_F, APP + "f_dry")
        for quality, level in (("heat", heat), ("performance", performance)):
            text += assertion(APP + name, v.HAS_QA_ESTIMATION, f"{APP}{name}_{quality}")
            text += quality_value(f"{name}_{quality}", quality, level)
    for number, (level, operator) in enumerate(limits):
        text += assertion(APP + "o_dry", v.HAS_NFR, f"{APP}limit{number}")
        text += quality_value(f"limit{number}", "heat", level, operator)
    return text


@pytest.fixture
def read(tmp_path):
    def read(*limits, sign="1"):
        (tmp_path / "app.owl").write_text(model(limits, sign))
        return read_knowledge_base([tmp_path / "app.owl"], utility="performance")

    return read


@pytest.fixture(params=["pellet", "rules"])
def loop(request, pellet):
    """Return a function that makes a loop in which a design runs."""

    def make(knowledge_base, objectives, design="brisk"):
        reasoner = pellet if request.param == "pellet" else RuleEngine()
        reasoner.load(knowledge_base.ontology)
        core = Mape(knowledge_base, reasoner, objectives, SETTINGS)
        core.step(0.0)
        core.observe_active(0.1, "f_dry", design, "STABLE")
        assert core.step(0.1) == []
        return core

    return make


@pytest.mark.parametrize(("sign", "names"), [("1", ("heat_min", "heat")), ("-1", ("heat", "heat_max"))])
def test_band_of_a_model_has_two_limits(read, sign, names):
    (objective,) = read((40, "<"), (70, ">"), sign=sign).objectives
    assert objective.limits == dict(zip(names, (40.0, 70.0), strict=True))


@pytest.mark.parametrize(
    ("level", "expected", "words"),
    [(75.0, "slow", "heat 75 > 70"), (35.0, "fast", "heat_min 35 < 40")],
)
def test_violation_on_either_side_leads_to_another_design(read, loop, level, expected, words):
    knowledge_base = read((20, "<"), (95, ">"))
    core = loop(knowledge_base, [Objective("o_dry", "f_dry", {"heat_min": 40.0, "heat": 70.0})])
    core.observe_level(1.0, "heat", 55.0)
    assert core.step(1.0) == []
    core.observe_level(2.0, "heat", level)
    (decision,) = core.step(2.0)
    assert words in decision.causes[0]
    rejected = {c.name: c.lost_because + c.refused_because for c in decision.candidates}
    assert "heat_min 30 < 40" in rejected["slow"]
    assert "heat 90 > 70" in rejected["fast"]


def test_design_within_the_band_is_taken(read, loop):
    core = loop(read((40, "<"), (70, ">")), [Objective("o_dry", "f_dry", {"heat_min": 40.0, "heat": 70.0})], "fast")
    core.observe_level(1.0, "heat", 88.0)
    (decision,) = core.step(1.0)
    assert (decision.to_configuration, decision.degraded) == ("brisk", False)


def test_operator_may_set_the_other_side(read, loop):
    core = loop(read((95, ">")), [Objective("o_dry", "f_dry", {"heat": 95.0})])
    core.observe_level(1.0, "heat", 50.0)
    core.operator.set_nfr("o_dry", "heat_min", 60.0)
    core.observe_level(2.0, "heat", 50.0)
    (decision,) = core.step(2.0)
    assert decision.to_configuration == "fast"


def test_objectives_may_have_different_limits_of_one_quality(read, pellet):
    knowledge_base = read()
    pellet.load(knowledge_base.ontology)
    objectives = Objective("o_dry", "f_dry", {"heat": 80.0}), Objective("o_gently", "f_dry", {"heat": 40.0})
    levels = {("o_dry", "heat"): 50.0, ("o_gently", "heat"): 50.0}
    facts = Facts(objectives, {"o_dry": "brisk", "o_gently": "brisk"}, levels)
    found = knowledge_base.analyse(facts, pellet).objectives
    assert {name: result.violated for name, result in found.items()} == {"o_dry": (), "o_gently": ("heat",)}


def test_saved_band_loads_again(read, pellet, tmp_path):
    knowledge_base = read((40, "<"), (70, ">"))
    facts = Facts(knowledge_base.objectives, {"o_dry": "brisk"}, {("o_dry", "heat"): 80.0, ("o_dry", "heat_min"): 80.0})
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, facts)
    again = read_knowledge_base([tmp_path / "saved.owl"], utility="performance")
    assert again.objectives == knowledge_base.objectives
    assert again.qualities == knowledge_base.qualities
    pellet.load(again.ontology)
    assert again.analyse(facts, pellet).objectives["o_dry"].violated == ("heat",)


@pytest.mark.parametrize("sign", ["1", "-1"])
def test_band_as_a_parameter(read, sign):
    knowledge_base = read(sign=sign)
    (objective,) = Parameters({"nfr_heat": [40, 70]}).objectives(knowledge_base)
    expected = {"heat_min": 40.0, "heat": 70.0} if sign == "1" else {"heat": 40.0, "heat_max": 70.0}
    assert objective.limits == expected
    (one_end,) = Parameters({f"nfr_{next(iter(set(expected) - {'heat'}))}": 45}).objectives(knowledge_base)
    assert list(one_end.limits.values()) == [45.0]


@pytest.mark.parametrize("given", [[70, 40], [40], [40, 60, 70], ["a", 3]])
def test_band_that_makes_no_sense_is_refused(read, given):
    with pytest.raises(ParameterError, match="nfr_heat"):
        Parameters({"nfr_heat": given}).objectives(read())


def test_limit_on_the_same_side_under_another_name_is_unknown(read, caplog):
    (objective,) = Parameters({"nfr_heat_max": 70}).objectives(read())
    assert objective.limits == {}
    assert "Unsupported QA TYPE received: heat_max" in caplog.text


def test_operator_that_is_none_is_named(read):
    with pytest.raises(KnowledgeBaseError, match="nfr_comparison_operator of limit0: '!' is not a comparison"):
        read((40, "!"))


def test_two_limits_on_one_side_are_named(read, caplog):
    read((40, ""), (70, ""))
    assert "the limits of a band differ in nfr_comparison_operator" in caplog.text
