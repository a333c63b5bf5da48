"""Designs that need surroundings: excluded where they can't work, taken again where they can."""

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Need, Objective
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.surroundings import Surroundings
from mros1_reasoner.pellet.owlready import run_pellet
from ontology_text import APP, assertion, typed

SETTINGS = Settings(history=1, violation_window=0.0, cool_down=0.5)
DESIGNS = {"stereo": 1.0, "lidar": 0.6, "bumper": 0.2}


def constraint(name, design, attribute, **limits):
    text = typed(APP + name, v.TOMASYS + "EnvironmentConstraint") + assertion(APP + name, v.CONSTRAINS, APP + attribute)
    text += assertion(APP + design, v.REQUIRES_ENVIRONMENT, APP + name)
    ends = {"least": v.ENV_LEAST, "most": v.ENV_MOST}
    return text + "".join(assertion(APP + name, ends[end], level, v.XSD + "decimal") for end, level in limits.items())


def model(*constraints):
    text = typed(APP + "f_see", v.FUNCTION) + typed(APP + "performance", v.QA_TYPE)
    text += "".join(typed(APP + name, v.ENVIRONMENT_ATTRIBUTE) for name in ("light", "dust"))
    for design, performance in DESIGNS.items():
        text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_see")
        text += typed(f"{APP}{design}_p", v.QA_VALUE) + assertion(APP + design, v.HAS_QA_ESTIMATION, f"{APP}{design}_p")
        text += assertion(f"{APP}{design}_p", v.IS_QA_TYPE, APP + "performance")
        text += assertion(f"{APP}{design}_p", v.HAS_VALUE, performance, v.XSD + "decimal")
    return text + "".join(constraints)


LIGHT = constraint("k1", "stereo", "light", least=0.25)
DUST = constraint("k2", "lidar", "dust", most=3)


@pytest.fixture
def read(tmp_path):
    def read(text=None):
        (tmp_path / "app.owl").write_text(model(LIGHT, DUST) if text is None else text)
        return read_knowledge_base([tmp_path / "app.owl"], utility="performance")

    return read


@pytest.fixture(params=["pellet", "rules"])
def loop(request, read, pellet):
    """Return a function that makes a loop in which nothing runs, or a design does."""

    def make(design="", **settings):
        knowledge_base = read()
        reasoner = pellet if request.param == "pellet" else RuleEngine()
        reasoner.load(knowledge_base.ontology)
        core = Mape(knowledge_base, reasoner, [Objective("o_see", "f_see")], Settings(**{**vars(SETTINGS), **settings}))
        core.step(0.0)
        if design:
            core.observe_active(0.1, "f_see", design, "STABLE")
            core.step(0.1)
        return core

    return make


def test_needs_of_a_model(read):
    designs = read().designs
    assert designs["stereo"].needs == (Need("light", least=0.25),)
    assert designs["lidar"].needs == (Need("dust", most=3.0),)


def test_design_that_cannot_work_here_is_not_tried_first(loop):
    core = loop(start_grace=0.5)
    core.observe_level(1.0, "light", 0.1)
    (decision,) = core.step(1.0)
    assert decision.to_configuration == "lidar"
    stereo = next(c for c in decision.candidates if c.name == "stereo")
    assert stereo.lost_because == "light 0.1 < 0.25"


def test_design_that_can_no_longer_work_is_left_at_once_and_taken_again(loop):
    core = loop("stereo")
    core.observe_level(1.0, "light", 0.9)
    assert core.step(1.0) == []
    core.observe_level(2.0, "light", 0.2, stamp=1.9)
    (decision,) = core.step(2.0)
    assert (decision.trigger, decision.to_configuration) == ("environment:light", "lidar")
    assert decision.causes == ("light 0.2 < 0.25, which stereo needs",)
    assert decision.stamp_monitored == 1.9
    core.report(2.1, decision.id, ok=True)
    core.observe_level(3.0, "light", 0.27)  # not beyond the limit by a fifth
    assert core.step(3.0) == []
    core.observe_level(4.0, "light", 0.4)
    (decision,) = core.step(4.0)
    assert (decision.to_configuration, decision.causes) == ("stereo", ("stereo can be deployed again",))


def test_feasible_heeds_surroundings(loop):
    core = loop()
    core.observe_level(1.0, "light", 0.1)
    assert core.feasible() == {"f_see": ("lidar", "bumper")}
    core.observe_level(2.0, "dust", 5.0)
    assert core.feasible() == {"f_see": ("bumper",)}


def test_value_that_only_another_design_minds_changes_nothing(loop):
    core = loop("stereo")
    core.observe_level(2.0, "dust", 5.0)  # of another design
    assert core.step(2.0) == []


def test_saved_knowledge_base_concludes_the_same(loop, read, tmp_path):
    core = loop("stereo")
    core.observe_level(1.0, "light", 0.1)
    core.step(1.0)
    world = read().world(core.known)
    run_pellet(world)
    assert list(world[APP + "stereo"].fd_realisability) == [False]
    assert v.IN_ERROR_COMPONENT in world[v.RUNTIME + "o_see"].o_status
    save_knowledge_base(tmp_path / "saved.owl", read(), core.known)
    assert read_knowledge_base([tmp_path / "saved.owl"]).designs["stereo"].needs == (Need("light", least=0.25),)


@pytest.mark.parametrize("order", [1, -1])
def test_each_need_is_judged_by_itself(order):
    bright, dim = Need("light", least=0.5), Need("light", least=0.25)
    seen = Surroundings([bright, dim][::order], 1, 0.2)
    seen.observe(1.0, "light", 0.1)
    assert set(seen.unmet) == {bright, dim}
    seen.observe(2.0, "light", 0.52)
    assert set(seen.unmet) == {bright}
    told = seen.values["light"]
    assert bright.lack(told)
    assert not dim.lack(told)


def test_median_of_values_counts():
    seen = Surroundings([Need("light", least=0.25)], 5, 0.2)
    for stamp, value in enumerate((0.9, 0.9, 0.1, 0.9, 0.1)):
        seen.observe(stamp, "light", value)
        assert not seen.unmet
    seen.observe(5.0, "light", 0.1)
    assert seen.unmet == {Need("light", least=0.25): 5.0}


@pytest.mark.parametrize(
    ("need", "bad", "doubtful", "good"), [((0.25, 9.0), 0.2, 0.28, 0.31), ((-9.0, 10.0), 11.0, 9.0, 7.9)]
)
def test_value_fits_again_when_it_is_well_within(need, bad, doubtful, good):
    seen = Surroundings([Need("x", *need)], 1, 0.2)
    for value, is_unmet in ((bad, True), (doubtful, True), (good, False), (doubtful, False)):
        seen.observe(1.0, "x", value)
        assert bool(seen.unmet) == is_unmet


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(constraint("k", "stereo", "light")), "k, which stereo requires, must have one constrains"),
        (model(LIGHT, typed(APP + "light", v.QA_TYPE)), "light is both a quality and of the environment"),
    ],
)
def test_constraint_that_makes_no_sense_is_named(read, text, words):
    with pytest.raises(KnowledgeBaseError, match=words):
        read(text)
