"""How components are repaired: read from any ontology, kept in a saved one, and no burden for a reasoner."""

import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import read_knowledge_base, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts, Objective, Repair
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.pellet.owlready import run_pellet
from ontology_text import APP, assertion, swrl, typed

DECIMAL, INTEGER = v.XSD + "decimal", v.XSD + "integer"
DIVE = Objective("o_dive", "f_dive")


def repair(name, *components, kind=v.REPAIR, datatype=DECIMAL, **numbers):
    text = typed(APP + name, kind) if kind else ""
    text += "".join(assertion(APP + name, v.REPAIRS, APP + component) for component in components)
    return text + "".join(
        assertion(APP + name, f"{v.TOMASYS}repair_{key}", number, datatype) for key, number in numbers.items()
    )


def submarine(*more):
    """Return a model of two designs, one of which brings a node of its own, the mapper."""
    text = typed(APP + "f_dive", v.FUNCTION)
    for design, component in (("by_sonar", "ping/sonar"), ("by_lamp", "lamp")):
        text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_dive")
        text += typed(APP + component, v.COMPONENT) + assertion(APP + component, v.REQUIRED_BY, APP + design)
    text += typed(APP + "mapper", v.COMPONENT) + assertion(APP + "mapper", v.DEPLOYED_BY, APP + "by_lamp")
    return text + "".join(more)


SONAR = repair("restart", "ping/sonar", duration=2.5, success=0.9, attempts=3)


@pytest.fixture
def read(tmp_path):
    def read(*more):
        (tmp_path / "submarine.owl").write_text(submarine(*more))
        return read_knowledge_base([tmp_path / "submarine.owl"])

    return read


@pytest.fixture(params=["pellet", "rules"])
def reasoner(request):
    return request.getfixturevalue("pellet") if request.param == "pellet" else RuleEngine()


def test_repairs_are_read_by_component(read):
    assert read().repairs == {}
    lamp = repair("fix_lamp", "lamp", duration=4)
    assert read(SONAR, lamp).repairs == {
        "ping/sonar": Repair("ping/sonar", 2.5, 0.9, 3),
        "lamp": Repair("lamp", 4.0, Repair.success, Repair.attempts),
    }


@pytest.mark.parametrize("kind", [v.REPAIR, "", APP + "DriverRestart"])
@pytest.mark.parametrize("datatype", [DECIMAL, INTEGER, v.XSD + "double", v.XSD + "string"])
def test_ontology_made_elsewhere_may_say_it_in_its_way(read, kind, datatype):
    found = read(repair("r", "lamp", kind=kind, datatype=datatype, duration=7, success=1, attempts=1)).repairs
    assert found == {"lamp": Repair("lamp", 7.0, 1.0, 1)}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (repair("r", "lamp"), "Repair r has no repair_duration: give it one number > 0, in s"),
        (repair("r", "lamp", duration=0), "repair_duration of r is 0: give it one number > 0"),
        (repair("r", "lamp", duration=-1.5), "repair_duration of r is -1.5: "),
        (repair("r", "lamp", duration="soon", datatype=v.XSD + "string"), "repair_duration of r is soon: "),
        (repair("r", "lamp", duration="INF", datatype=v.XSD + "double"), "repair_duration of r is inf: "),
        (repair("r", "lamp", duration=1) + repair("r", duration=2), "repair_duration of r is 1, 2: "),
        (repair("r", "lamp") + assertion(APP + "r", v.REPAIR_DURATION, APP + "long"), "repair_duration of r is long: "),
        (repair("r", "lamp", duration=1, success=1.2), "repair_success of r is 1.2: give it one number from 0 to 1"),
        (repair("r", "lamp", duration=1, success=-0.1), "repair_success of r is -0.1: "),
        (repair("r", "lamp", duration=1, attempts=0), "repair_attempts of r is 0: give it one whole number from 1"),
        (repair("r", "lamp", duration=1, attempts=1.5), "repair_attempts of r is 1.5: "),
        (repair("r", "lamp", duration=1) + repair("s", "lamp", duration=2), "r and s both repair lamp: leave one"),
        (repair("r", "by_lamp", duration=1), "r repairs by_lamp, which is no Component: name one of the model"),
        (repair("r", "lamp", "mapper", duration=1), "Repair r must have one repairs: name the component"),
        (repair("r", duration=1), "Repair r must have one repairs: name the component"),
    ],
)
def test_repair_that_cannot_be_is_named_in_one_line(read, text, words):
    with pytest.raises(KnowledgeBaseError, match=r"submarine\.owl: ") as caught:
        read(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_saved_knowledge_base_has_the_repairs(read, tmp_path):
    facts = Facts((DIVE,), {"o_dive": "by_sonar"}, components={"ping/sonar": v.FAILED})
    save_knowledge_base(tmp_path / "saved.owl", read(SONAR), facts)
    assert read_knowledge_base([tmp_path / "saved.owl"]).repairs == read(SONAR).repairs
    world = read(SONAR).world(facts)
    run_pellet(world)
    assert world[APP + "restart"].repair_duration == 2.5
    assert list(world[APP + "by_sonar"].fd_realisability) == [False]


def test_reasoner_is_not_given_what_no_rule_reads(read):
    named = typed(APP + "restart", v.OWL_NAMED_INDIVIDUAL)
    node = repair("again", "mapper", duration=1)
    assert read(SONAR, named, node).ontology == read().ontology
    assert read(node).own_nodes == {"mapper"}


def test_rule_of_a_model_may_read_repairs(read, reasoner):
    slow = swrl(
        "repair_duration(?r, ?s_weight), repairs(?r, ?c), greaterThan(?s_weight, 2), mros:requiredBy(?c, ?fd)"
        " -> fd_realisability(?fd, false)"
    ).replace("IndividualPropertyAtom", "DatavaluedPropertyAtom", 1)
    knowledge_base = read(SONAR, repair("r", "lamp", duration=1), slow)
    reasoner.load(knowledge_base.ontology)
    assert set(knowledge_base.analyse(Facts((DIVE,)), reasoner).unrealisable) == {"by_sonar"}
