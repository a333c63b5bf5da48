"""Corrections that hold only for designs that a cause touches alike: a bin picker whose fast detector needs light."""

import pytest
from metacontrol_bags.decision import DECIDED
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge.model import Direction, Objective
from mros1_reasoner.knowledge.scale import Correction, Scale
from mros1_reasoner.loop.levels import Expectation, Judging, Levels
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from ros_model.cli.rosmodel import main

CELL = """RosSystem { Name bin
    RosComponents (
        ComponentInterface { name lens FromRosNode 'p.lens.lens'
            RosPublishers { RosPublisher image { RefPublisher 'p.lens.lens.image' } } },
        ComponentInterface { name detector FromRosNode 'p.detector.detector'
            RosSubscribers { RosSubscriber image { RefSubscriber 'p.detector.detector.image' } }
            RosParameters {
                RosParameter network { RefParameter 'p.detector.detector.network' value 'fast' },
                RosParameter rate { RefParameter 'p.detector.detector.rate' value 5.0 } } }
    )
    TopicConnections { TopicConnection image { From ( 'lens.image' ) To ( 'detector.image' ) } }
}"""
PROJECT = """
package: bin_picker
base: bin.rossystem
variants:
  component: detector
  table: variants.csv
  qa: qa.csv
  parameters: {network: [network], rate: [rate]}
functions: {f_detect: {designs: all}}
quality_attributes:
  hits: {direction: higher_is_better, range: [0.0, 1.0]CORRECTION}
  performance: {direction: higher_is_better, range: [0.0, 1.0]}
utility: performance
objectives: {o_detect: {function: f_detect, nfrs: {hits: 0.6}}}
"""
VARIANTS = "name,network,rate\nquick,fast,5.0\nquicker,fast,9.0\ncareful,large,2.0\n"
LEVELS = "name,hits,performance,source\nquick,0.8,0.8,measured\nquicker,0.7,0.7,measured\ncareful,0.95,0.3,measured\n"


@pytest.fixture
def models(tmp_path):
    """Return a function that writes the project, with what limits the corrections of hits."""

    def write(correction=""):
        folder = tmp_path / "models"
        folder.mkdir()
        texts = {"bin.rossystem": CELL, "variants.csv": VARIANTS, "qa.csv": LEVELS}
        texts["metacontrol.yaml"] = PROJECT.replace("CORRECTION", correction)
        for name, text in texts.items():
            (folder / name).write_text(text)
        return folder

    return write


@pytest.fixture
def knowledge_base(models):
    def make(correction=""):
        folder = models(correction)
        with pytest.raises(SystemExit) as done:
            main(["generate", "tomasys", str(folder), "-o", str(folder.parent)])
        assert done.value.code == 0
        return read_knowledge_base([folder / "bin.owl"])

    return make


def dark(kb, pellet):
    """Return what is decided where quick hits half as often as expected, and the loop."""
    pellet.load(kb.ontology)
    core = Mape(kb, pellet, kb.objectives, Settings(start_grace=0.0, cool_down=0.0))
    core.observe_active(0.0, "f_detect", "quick", "STABLE")
    for second in range(1, 8):
        core.observe_level(float(second), "hits", 0.4)
        for decision in core.step(float(second)):
            assert decision.state == DECIDED
            return decision, core
    raise AssertionError("nothing was decided")


def test_by_default_a_correction_holds_for_every_design(knowledge_base, pellet):
    decision, _ = dark(knowledge_base(), pellet)
    assert decision.degraded
    levels = {c.name: c.levels["hits"] for c in decision.candidates}
    assert levels == pytest.approx({"quick": 0.4, "quicker": 0.35, "careful": 0.475})


@pytest.mark.parametrize("same", ["[detector.network]", "[lens, detector.network]"])
def test_correction_holds_for_designs_with_the_same_parameter(knowledge_base, pellet, same):
    kb = knowledge_base(f", correction: {{same: {same}}}")
    groups = {name: design.group("hits") for name, design in kb.designs.items()}
    assert groups["quick"] == groups["quicker"] != groups["careful"]
    assert {design.group("performance") for design in kb.designs.values()} == {""}
    decision, core = dark(kb, pellet)
    assert (decision.to_configuration, decision.degraded) == ("careful", False)
    refused = {c.name: c.refused_because for c in decision.candidates}
    assert refused["quicker"].startswith("hits 0.35 (0.5 times what was expected) < 0.6")
    assert decision.corrections[0].startswith("hits was 0.5 times what was expected of designs with ")
    assert "detector.network: fast: 0.5 times that (at most 2.5 times) is expected of these" in decision.corrections[0]
    # Nobody observes the fast network now: what was learnt of it fades.
    core.report(8.0, decision.id, True)
    core.observe_level(9.0, "hits", 0.95)
    group = groups["quick"]
    factors = [core._deliberation.corrections("o_detect", now)["hits", group].factor for now in (9.0, 40.0, 300.0)]
    assert factors == sorted(factors)
    assert factors[0] < 0.6
    assert factors[-1] > 0.99
    careful = core._deliberation.corrections("o_detect", 9.0).get(("hits", groups["careful"]), Correction())
    assert careful.factor == pytest.approx(1.0)


def test_groups_are_saved_with_the_knowledge_base(knowledge_base, tmp_path):
    kb = knowledge_base(", correction: {same: [detector.network]}")
    (tmp_path / "saved.owl").write_bytes(kb.rdf_xml())
    assert read_knowledge_base([tmp_path / "saved.owl"]).designs["careful"].group("hits") == "detector.network: large"


@pytest.mark.parametrize(
    ("correction", "says"),
    [
        (", correction: {same: [lamp]}", "'lamp' is no component of the base or of a variant"),
        (", correction: {same: [detector.speed]}", "'detector.speed' is no parameter of a component"),
        (", correction: {same: detector}", "must be a list of names"),
        (", correction: {alike: [detector]}", "same"),
    ],
)
def test_wrong_limits_of_a_correction_are_named_by_check(models, capsys, correction, says):
    with pytest.raises(SystemExit) as done:
        main(["check", str(models(correction))])
    said = capsys.readouterr()
    assert done.value.code == 1
    assert says in said.out + said.err
    assert "quality_attributes.hits.correction" in said.out + said.err


def test_levels_of_one_group_say_nothing_of_another():
    levels = Levels(Judging(memory=10.0))
    for second in range(60):
        levels.observe(second, ("o", "q"), 0.4, Expectation(expected=0.8, group="dark"))
    assert levels.groups(("o", "q")) == ["dark"]
    assert levels.strain(60.0, ("o", "q"), "dark").factor == pytest.approx(0.5)
    assert levels.strain(60.0, ("o", "q"), "light") is None
    levels.forget("o")
    assert levels.strain(60.0, ("o", "q"), "dark").factor == pytest.approx(0.5)
    levels.drop("o")
    assert levels.groups(("o", "q")) == []


def test_design_that_found_nothing_is_left_until_most_of_that_is_forgotten():
    levels, scale, key = Levels(Judging(memory=30.0)), Scale(Direction.HIGHER_IS_BETTER), ("o", "hits")
    for second in range(10):
        levels.observe(second, key, 0.0, Expectation(scale, expected=0.9, group="fast"))
    levels.blame(10.0, key)
    levels.forget("o")

    def is_gone(now):
        levels.observe(now, key, 0.6, Expectation(scale, expected=0.6, group="large"))
        return levels.gone_since(now, "o") is not None

    # 0 times counts as 0.4 times, which fades to 0.48 times in 0.65 time constants.
    assert next(now for now in range(11, 300) if is_gone(now)) == 29


def test_objective_without_limits_is_not_corrected(knowledge_base, pellet):
    kb = knowledge_base()
    pellet.load(kb.ontology)
    core = Mape(kb, pellet, [Objective("o_detect", "f_detect")], Settings(start_grace=0.0))
    core.observe_active(0.0, "f_detect", "quick", "STABLE")
    core.observe_level(1.0, "hits", 0.1)
    assert core._deliberation.corrections("o_detect", 1.0) == {}
