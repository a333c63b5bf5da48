"""The rule engine infers what Pellet infers, or refuses what it does not know."""

import random

import pytest
from generated_ontologies import ASKED, facts, ontologies
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from mros1_reasoner import forward
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import own_ontologies, read_triples
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.loading import renamed
from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, ReasonerError
from mros1_reasoner.knowledge.triples import write_ntriples
from ontology_text import APP, OWL, RDFS, assertion, axiom, key, swrl, typed

STRING, DECIMAL = v.XSD + "string", v.XSD + "decimal"
NEAR, BESIDE, WEIGHT = (f"{APP}{name}" for name in ("near", "beside", "weight"))
DECLARED = (
    typed(NEAR, OWL + "ObjectProperty")
    + typed(BESIDE, OWL + "ObjectProperty")
    + typed(WEIGHT, OWL + "DatatypeProperty")
    + typed(f"{APP}Part", OWL + "Class")
    + "".join(typed(f"{APP}x{i}", f"{APP}Part") for i in range(5))
)
CHAIN = "".join(assertion(f"{APP}x{i}", NEAR, f"{APP}x{i + 1}") for i in range(4))


@pytest.fixture(scope="module")
def vocabulary():
    """All of the generic rules, whether or not a model has use for them."""
    return write_ntriples(t for i, path in enumerate(own_ontologies()) for t in renamed(read_triples(path), i))


@pytest.fixture
def engine():
    return RuleEngine()


@pytest.fixture
def both(engine, plain):
    """Return a function: what both reasoners infer, as one result where they agree."""

    def infer(text, *asked, known=()):
        found = []
        for reasoner in (engine, plain):
            try:
                reasoner.load(DECLARED + text)
                found.append(reasoner.infer(list(known), asked))
            except InconsistentError:
                found.append("contradiction")
        assert found[0] == found[1]
        return found[0]

    return infer


def pairs(found):
    return {(a.subject.removeprefix(APP), a.value.removeprefix(APP)) for a in found}


@settings(max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(application=ontologies(of_rules=True), known=facts())
def test_engine_infers_what_pellet_does_where_rules_can_say_it(plain, vocabulary, application, known):
    results = []
    for reasoner in (RuleEngine(), plain):
        try:
            reasoner.load(vocabulary + application)
            results.append(reasoner.infer(known, ASKED))
        except InconsistentError:
            results.append("contradiction")
    assert results[0] == results[1]


@settings(max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(application=ontologies(), known=facts())
def test_engine_infers_what_pellet_does_of_every_shape_or_refuses_it(plain, vocabulary, application, known):
    results = []
    for reasoner in (RuleEngine(), plain):
        try:
            reasoner.load(vocabulary + application)
            results.append(reasoner.infer(known, ASKED))
        except InconsistentError:
            results.append("contradiction")
        except ReasonerError as error:
            assert reasoner is plain or "set ~reasoner to pellet" in str(error)
            event("refused" if reasoner is not plain else "a defect of Pellet")
            return
    event("compared")
    assert results[0] == results[1]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            CHAIN + typed(NEAR, OWL + "TransitiveProperty"),
            {(f"x{i}", f"x{j}") for i in range(5) for j in range(i + 1, 5)},
        ),
        (
            assertion(APP + "x0", NEAR, APP + "x1") + typed(NEAR, OWL + "SymmetricProperty"),
            {("x0", "x1"), ("x1", "x0")},
        ),
        (assertion(APP + "x0", BESIDE, APP + "x1") + assertion(BESIDE, RDFS + "subPropertyOf", NEAR), {("x0", "x1")}),
        (assertion(APP + "x0", BESIDE, APP + "x1") + assertion(NEAR, OWL + "inverseOf", BESIDE), {("x1", "x0")}),
        (
            assertion(APP + "x0", BESIDE, APP + "x1") + assertion(NEAR, OWL + "equivalentProperty", BESIDE),
            {("x0", "x1")},
        ),
        (CHAIN + swrl("app:near(?x, ?y), app:near(?y, ?z) -> app:near(?z, ?x)"), None),
        (
            assertion(APP + "x0", APP + "of", APP + "x1")
            + typed(APP + "of", OWL + "ObjectProperty")
            + assertion(APP + "of", v.RDFS_RANGE, APP + "Whole")
            + assertion(APP + "of", v.RDFS_DOMAIN, APP + "Bit")
            + assertion(APP + "Bit", RDFS + "subClassOf", APP + "Small")
            + "".join(typed(APP + name, OWL + "Class") for name in ("Whole", "Bit", "Small"))
            + swrl("app:Small(?x), app:Whole(?y) -> app:near(?x, ?y)"),
            {("x0", "x1")},
        ),
    ],
)
def test_axioms_conclude(both, text, expected):
    found = pairs(both(text, NEAR))
    assert found == expected if expected is not None else len(found) > 4


@pytest.mark.parametrize(
    ("condition", "names"),
    [
        ("greaterThan(?w, 2)", {"x3", "x4"}),
        ("lessThanOrEqual(?w, 1.0)", {"x0", "x1"}),
        ("equal(?w, 2.0)", {"x2"}),
        ("multiply(?p, ?w, -1), lessThan(?p, -2.5)", {"x3", "x4"}),
        ("add(?p, ?w, ?w), equal(?p, 6)", {"x3"}),
        ("subtract(4, ?w, 0)", {"x4"}),
    ],
)
def test_built_ins_compare_and_compute(both, condition, names):
    weights = "".join(assertion(f"{APP}x{i}", WEIGHT, f"{i}.0", DECIMAL) for i in range(5))
    found = both(weights + swrl(f"app:weight(?x, ?w), {condition} -> app:near(?x, ?x)"), NEAR)
    assert pairs(found) == {(name, name) for name in names}


@pytest.mark.parametrize(
    "text",
    [
        typed(WEIGHT, v.OWL_FUNCTIONAL_PROPERTY) + "".join(assertion(APP + "x0", WEIGHT, n, DECIMAL) for n in (1, 2)),
        typed(APP + "Whole", OWL + "Class")
        + typed(APP + "x0", APP + "Whole")
        + assertion(APP + "Part", OWL + "disjointWith", APP + "Whole"),
        assertion(WEIGHT, v.RDFS_RANGE, STRING) + assertion(APP + "x0", WEIGHT, "1", DECIMAL),
    ],
)
def test_contradictions_are_found(both, text):
    assert both(text, WEIGHT) == "contradiction"


def test_contradiction_names_individual_and_property(engine):
    engine.load(DECLARED + typed(WEIGHT, v.OWL_FUNCTIONAL_PROPERTY))
    known = [Assertion(APP + "x0", WEIGHT, n, DECIMAL) for n in ("1", "2")]
    with pytest.raises(InconsistentError, match=r"#x0 has more than one value for the functional property .*weight"):
        engine.infer(known, [WEIGHT])
    assert len(engine.infer(known[:1], [WEIGHT])) == 1


def test_facts_hold_for_one_analysis(engine):
    engine.load(DECLARED + swrl("app:near(?x, ?y) -> app:beside(?y, ?x)"))
    assert pairs(engine.infer([Assertion(APP + "x0", NEAR, APP + "x1")], [BESIDE])) == {("x1", "x0")}
    assert engine.infer([], [BESIDE]) == []


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_order_of_statements_does_not_matter(seed):
    lines = (DECLARED + CHAIN + typed(NEAR, OWL + "TransitiveProperty")).splitlines(keepends=True)
    expected = RuleEngine()
    expected.load("".join(lines))
    random.Random(seed).shuffle(lines)
    shuffled = RuleEngine()
    shuffled.load("".join(lines))
    assert shuffled.infer([], [NEAR]) == expected.infer([], [NEAR])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (
            axiom("Restriction", {"onProperty": NEAR, "maxCardinality": 1}, of=(APP + "Part", RDFS + "subClassOf")),
            "Restriction",
        ),
        (key(f"{APP}Part", [WEIGHT]), "hasKey"),
        (typed(NEAR, OWL + "InverseFunctionalProperty"), "InverseFunctionalProperty"),
        (swrl("app:near(?x, ?y) -> app:near(?x, ?z)", "open"), "a variable that is in no atom of the body"),
        (swrl("app:near(?x, ?y), stringConcat(?x, ?y, ?y) -> app:near(?y, ?x)", "text"), "stringConcat"),
    ],
)
def test_what_the_engine_does_not_know_is_named(engine, text, what):
    with pytest.raises(ReasonerError, match=rf"does not know .*{what}.*: set ~reasoner to pellet") as caught:
        engine.load(DECLARED + text)
    assert "\n" not in str(caught.value)


def test_nothing_is_inferred_without_an_ontology(engine):
    with pytest.raises(ReasonerError, match="no ontology"):
        engine.infer([], [NEAR])
    with pytest.raises(ReasonerError, match="N-Triples"):
        engine.load("no triples")


COUNTING = assertion(APP + "x0", WEIGHT, "1", DECIMAL) + swrl(
    "app:weight(?x, ?w), add(?v, ?w, 1) -> app:weight(?x, ?v)", "counts"
)


def test_rule_that_counts_without_end_is_named(engine, monkeypatch):
    monkeypatch.setattr(forward.engine, "_MOST", 1000)
    others = swrl("app:weight(?x, ?w) -> app:near(?x, ?x)", "idle")
    with pytest.raises(
        ReasonerError, match="more than 1000 facts follow, most of them by rule counts: correct it"
    ) as caught:
        engine.load(DECLARED + COUNTING + others)
    assert "\n" not in str(caught.value)


def test_rule_that_joins_too_much_is_named(engine, monkeypatch):
    monkeypatch.setattr(forward.engine, "_MOST", 1000)
    with pytest.raises(ReasonerError, match="most of them by rule all"):
        engine.load(
            DECLARED
            + "".join(typed(f"{APP}y{i}", f"{APP}Part") for i in range(40))
            + swrl("app:Part(?x), app:Part(?y) -> app:near(?x, ?y)", "all")
        )


def test_rule_that_counts_to_a_bound_comes_to_an_end(engine):
    bounded = swrl("app:weight(?x, ?w), lessThan(?w, 200), add(?v, ?w, 1) -> app:weight(?x, ?v)", "bounded")
    engine.load(DECLARED + assertion(APP + "x0", WEIGHT, "1", DECIMAL) + bounded)
    assert len(engine.infer([], [WEIGHT])) == 200


def test_number_that_is_too_large_to_compute_has_no_value(engine):
    squares = swrl("app:weight(?x, ?w), multiply(?v, ?w, ?w) -> app:weight(?x, ?v)", "squares")
    engine.load(DECLARED + assertion(APP + "x0", WEIGHT, "10", DECIMAL) + squares)
