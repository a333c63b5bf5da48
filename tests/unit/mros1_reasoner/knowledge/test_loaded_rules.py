"""Rules that a model brings along count beside the generic ones, under published names and former ones."""

import logging

import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Direction, Facts, Objective
from mros1_reasoner.knowledge.rules import rules_of
from mros1_reasoner.knowledge.triples import Graph, parse_ntriples
from ontology_text import APP, assertion, swrl, typed

OBJECTIVE = Objective("o_see", "f_see", {"energy": 0.5})
COMPARISON = (
    "Objective(?a), hasNFR(?a, ?n), solvesO(?b, ?a), hasQAvalue(?b, ?m), isQAtype(?m, {kind}), isQAtype(?n, {kind}), "
    "hasValue(?n, ?x), hasValue(?m, ?y), {how} -> o_status(?a, '{status}')"
)


def level(name, quality, number, owner, predicate):
    return (
        typed(APP + name, v.QA_VALUE)
        + assertion(APP + name, v.IS_QA_TYPE, APP + quality)
        + assertion(APP + name, v.HAS_VALUE, number, v.XSD + "float")
        + assertion(APP + owner, predicate, APP + name)
    )


def model(*rules, labels=(), extra=""):
    text = typed(APP + "f_see", v.FUNCTION) + typed(APP + "lamp", v.COMPONENT) + typed(APP + "lens", v.COMPONENT)
    text += "".join(typed(APP + quality, v.QA_TYPE) for quality in ("clarity", "energy"))
    for design, clarity in (("near", 0.2), ("far", 0.6)):
        text += typed(APP + design, v.FUNCTION_DESIGN) + assertion(APP + design, v.SOLVES_F, APP + "f_see")
        text += level(f"{design}_clarity", "clarity", clarity, design, v.HAS_QA_ESTIMATION)
    text += assertion(APP + "lamp", v.REQUIRED_BY, APP + "far")
    names = (*labels, *("rule",) * len(rules))
    return text + extra + "".join(swrl(rule, name) for rule, name in zip(rules, names, strict=False))


@pytest.fixture
def read(tmp_path):
    def read(*rules, **kwargs):
        (tmp_path / "app.owl").write_text(model(*rules, **kwargs))
        return read_knowledge_base([tmp_path / "app.owl"])

    return read


@pytest.fixture
def analyse(pellet):
    def analyse(knowledge_base, design="far", levels=None, **facts):
        pellet.load(knowledge_base.ontology)
        observed = {("o_see", quality): number for quality, number in (levels or {}).items()}
        known = Facts((OBJECTIVE,), {"o_see": design} if design else {}, levels=observed, **facts)
        return knowledge_base.analyse(known, pellet)

    return analyse


def labels(knowledge_base):
    return {rule.label for rule in rules_of(Graph(list(parse_ntriples(knowledge_base.ontology))))}


def test_level_below_what_is_expected_of_the_running_design(read, analyse):
    """As the published model of an underwater vehicle says of the visibility of water."""
    knowledge_base = read(
        "FunctionGrounding(?fg), QAvalue(?m), hasQAvalue(?fg, ?m), isQAtype(?m, app:clarity), typeFD(?fg, ?fd), "
        "hasQAestimation(?fd, ?e), isQAtype(?e, app:clarity), hasValue(?m, ?x), hasValue(?e, ?y), lessThan(?x, ?y) "
        "-> fg_status(?fg, 'IN_ERROR_NFR')"
    )
    assert knowledge_base.levels_read == {"clarity"}
    bad = analyse(knowledge_base, levels={"clarity": 0.5}).objectives["o_see"]
    assert (bad.status, bad.grounding_status, bad.violated) == (v.IN_ERROR_NFR, v.IN_ERROR_NFR, ())
    assert analyse(knowledge_base, levels={"clarity": 0.7}).objectives["o_see"].status == v.IN_PROGRESS
    assert analyse(knowledge_base, "near", {"clarity": 0.5}).objectives["o_see"].status == v.IN_PROGRESS


def test_status_in_a_body_holds_when_a_generic_rule_concludes_it(read, analyse):
    knowledge_base = read(
        "o_status(?o, 'IN_ERROR_NFR'), solvesO(?fg, ?o), typeFD(?fg, ?fd) -> fd_realisability(?fd, false)"
    )
    assert set(analyse(knowledge_base, levels={"energy": 0.6}).unrealisable) == {"far"}
    assert not analyse(knowledge_base, levels={"energy": 0.4}).unrealisable


def test_objective_without_a_grounding_can_be_read(read, analyse):
    knowledge_base = read("o_status(?o, 'UNGROUNDED'), typeF(?o, ?f), solvesF(?fd, ?f) -> fd_realisability(?fd, false)")
    assert set(analyse(knowledge_base, None).unrealisable) == {"near", "far"}
    assert not analyse(knowledge_base).unrealisable


def test_design_that_a_rule_excludes_has_no_component_to_blame(read, analyse):
    knowledge_base = read(
        "hasQAestimation(?fd, ?e), hasValue(?e, ?y), greaterThan(?y, 0.5) -> fd_realisability(?fd, false)"
    )
    assert analyse(knowledge_base).unrealisable == {"far": ()}
    assert analyse(knowledge_base, components={"lamp": "FALSE"}).unrealisable == {"far": ("lamp",)}


def test_rule_may_find_that_a_component_fails_with_another(read, analyse):
    knowledge_base = read("c_status(app:lens, 'FALSE') -> c_status(app:lamp, 'FALSE')")
    for status in ("TRUE", "RECOVERED"):
        result = analyse(knowledge_base, components={"lens": "FALSE", "lamp": status})
        assert result.unrealisable == {"far": ("lamp",)}
        assert result.objectives["o_see"].status == v.IN_ERROR_COMPONENT


def test_rule_may_call_for_a_better_design_as_a_status_or_as_a_boolean(read, analyse):
    for head in ("o_status(?o, 'UPDATABLE')", "o_updatable(?o, true)"):
        knowledge_base = read(
            f"hasQAvalue(?fg, ?q), hasValue(?q, ?x), greaterThan(?x, 0.9), solvesO(?fg, ?o) -> {head}"
        )
        assert analyse(knowledge_base, levels={"clarity": 0.95}).objectives["o_see"].causes == {v.UPDATABLE}


def test_failures_so_far_can_be_read(read, analyse):
    knowledge_base = read(
        "fd_error_log(?fd, ?o), typeF(?o, ?f), solvesF(?other, ?f) -> fd_realisability(?other, false)"
    )
    assert knowledge_base.reads_error_log
    assert not analyse(knowledge_base).unrealisable
    assert set(analyse(knowledge_base, tried=frozenset({("near", "o_see")})).unrealisable) == {"near", "far"}


@pytest.mark.parametrize(
    ("how", "direction", "reaches"),
    [
        ("greaterThan(?y, ?x)", Direction.LOWER_IS_BETTER, False),
        ("lessThan(?x, ?y)", Direction.LOWER_IS_BETTER, False),
        ("greaterThan(?x, ?y)", Direction.HIGHER_IS_BETTER, False),
        ("lessThanOrEqual(?y, ?x)", Direction.HIGHER_IS_BETTER, True),
    ],
)
@pytest.mark.parametrize("kind", ["app:clarity", "?t"])
def test_comparison_with_a_limit_tells_the_direction(read, analyse, caplog, how, direction, reaches, kind):
    knowledge_base = read(COMPARISON.format(kind=kind, how=how, status="INTERNAL_ERROR"))
    quality = knowledge_base.qualities["clarity"]
    assert (quality.direction, quality.reaching_violates) == (direction, reaches)
    assert "rule" not in labels(knowledge_base)
    assert "clarity: lower is better" not in caplog.text


def test_direction_that_the_model_states_takes_precedence_over_a_comparison(read):
    said = assertion(APP + "clarity", v.QA_SIGN, "1", v.XSD + "decimal")
    rule = COMPARISON.format(kind="app:clarity", how="greaterThan(?x, ?y)", status="IN_ERROR_NFR")
    assert read(rule, extra=said).qualities["clarity"].direction is Direction.LOWER_IS_BETTER


@pytest.mark.parametrize(
    ("how", "stated", "side"),
    [("less", "1", ""), ("greater", "-1", ""), ("less", "-1", "above"), ("greater", "1.0", "below")],
)
def test_comparison_that_contradicts_the_stated_direction_is_named(read, caplog, how, stated, side):
    said = assertion(APP + "clarity", v.QA_SIGN, stated, v.XSD + "decimal")
    rule = COMPARISON.format(kind="app:clarity", how=f"{how}Than(?x, ?y)", status="IN_ERROR_NFR")
    read(rule, extra=said)
    words = f"takes levels of clarity for violations where they are {side} the limit, against its qa_sign"
    assert (words in caplog.text) is bool(side)
    assert ("against its" in caplog.text) is bool(side)


def test_comparisons_that_disagree_are_named(read, caplog):
    rules = [
        COMPARISON.format(kind="app:clarity", how=f"{how}Than(?x, ?y)", status="IN_ERROR_NFR")
        for how in ("less", "greater")
    ]
    read(*rules, labels=("one", "two"))
    assert "rules one and two compare levels of clarity in opposite ways" in caplog.text


def test_comparison_on_a_condition_is_a_rule_of_its_own(read, analyse):
    rule = COMPARISON.format(kind="app:energy", how="greaterThan(?x, ?y)", status="IN_ERROR_NFR")
    knowledge_base = read(rule.replace(" ->", ", c_status(app:lens, 'FALSE') ->"))
    assert "rule" in labels(knowledge_base)
    assert analyse(knowledge_base, levels={"energy": 0.4}).objectives["o_see"].status == v.IN_PROGRESS
    assert analyse(knowledge_base, levels={"energy": 0.4}, components={"lens": "FALSE"}).objectives["o_see"].causes == {
        v.IN_ERROR_NFR
    }


@pytest.mark.parametrize(
    "copy",
    [
        "Objective(?x), solvesO(?y, ?x), fg_status(?y, 'IN_ERROR_NFR') -> o_status(?x, 'IN_ERROR_NFR')",
        "fg_status(?y, 'INTERNAL_ERROR'), solvesO(?y, ?x) -> o_status(?x, 'INTERNAL_ERROR')",
        "o_status(?x, 'EXTERNAL_ERROR'), requiresO(?y, ?x) -> fg_status(?y, 'EXTERNAL_ERROR')",
        "Component(?a), mros:requiredBy(?a, ?b), c_status(?a, false) -> fd_realisability(?b, false)",
        "mros:requiredBy(?a, ?b), c_status(?a, 'FALSE'), typeFD(?z, ?b) -> fg_status(?z, 'INTERNAL_ERROR')",
    ],
)
def test_copy_of_a_generic_rule_says_nothing_new(read, caplog, copy):
    with caplog.at_level(logging.WARNING):
        knowledge_base = read(copy, "app:near(?a, ?b) -> app:near(?b, ?a)", labels=("copy", "other"))
    assert "copy" not in labels(knowledge_base)
    assert "rule copy" not in caplog.text


def test_rule_that_only_resembles_a_generic_one_stays(read, analyse):
    knowledge_base = read("solvesO(?g, ?o), fg_status(?g, 'IN_ERROR_COMPONENT') -> o_status(?o, 'IN_ERROR_NFR')")
    result = analyse(knowledge_base, components={"lamp": "FALSE"})
    assert result.objectives["o_see"].causes == {v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR}


@pytest.mark.parametrize(
    ("rule", "facts", "causes"),
    [
        (
            "c_status(?c, false), typeFD(?g, ?d) -> fg_status(?g, 'INTERNAL_ERROR')",
            {"components": {"lens": "FALSE"}},
            v.IN_ERROR_COMPONENT,
        ),
        (
            "hasQAvalue(?g, ?q), hasValue(?q, ?x), lessThan(?x, 0.3) -> fg_status(?g, 'EXTERNAL_ERROR')",
            {"levels": {"clarity": 0.1}},
            v.IN_ERROR_NFR,
        ),
    ],
)
def test_errors_may_have_former_names(read, analyse, rule, facts, causes):
    assert analyse(read(rule), **facts).objectives["o_see"].causes == {causes}


@pytest.mark.parametrize("facts", [{"components": {"lamp": "FALSE"}}, {"levels": {"energy": 0.9}}])
def test_former_name_in_a_body_is_any_error(read, analyse, facts):
    knowledge_base = read(
        "o_status(?o, 'INTERNAL_ERROR'), typeF(?o, ?f), solvesF(?d, ?f) -> fd_realisability(?d, false)"
    )
    assert set(analyse(knowledge_base, **facts).unrealisable) == {"near", "far"}
    assert not analyse(knowledge_base).unrealisable


def test_status_that_nothing_heeds_is_named(read, caplog):
    read("Objective(?o) -> o_status(?o, 'IN_EROR')")
    assert 'rule rule concludes o_status "IN_EROR", which nothing heeds: known: IN_ERROR_NFR' in caplog.text


def test_vocabulary_that_a_model_brings_along_restricts_nothing(read, analyse):
    functional = typed(v.O_STATUS, v.OWL_FUNCTIONAL_PROPERTY) + typed(v.FG_STATUS, v.OWL_FUNCTIONAL_PROPERTY)
    boolean = assertion(v.C_STATUS, v.RDFS_RANGE, v.XSD + "boolean")
    knowledge_base = read("hasQAvalue(?g, ?q) -> fg_status(?g, 'IN_ERROR_NFR')", extra=functional + boolean)
    result = analyse(knowledge_base, levels={"clarity": 0.5}, components={"lamp": "FALSE"})
    assert result.objectives["o_see"].causes == {v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR}


def test_model_without_rules_goes_without_those_that_conclude_nothing_there(read):
    idle = {"S2", "S3", "S4", "S5", "S10", "S11", "F1", "F2", "F3", "F4", "QA_reached"}
    assert not labels(read()) & idle
    assert {"QA", "S1a", "S6b", "compError"} <= labels(read())


def test_levels_keep_their_names_in_the_model(read, analyse):
    """A rule may name them; a limit that somebody has set is another one."""
    limit = level("least", "clarity", 0.4, "o_see", v.HAS_NFR)
    objective = typed(APP + "o_see", v.OBJECTIVE) + assertion(APP + "o_see", v.TYPE_F, APP + "f_see")
    rule = "hasNFR(?o, app:least), hasValue(app:near_clarity, ?x), lessThan(?x, 0.3) -> o_status(?o, 'UPDATABLE')"
    knowledge_base = read(rule, extra=objective + limit)
    (own,) = knowledge_base.objectives
    named = {assertion.subject for assertion in knowledge_base.assertions(Facts((own,)))}
    other = {a.subject for a in knowledge_base.assertions(Facts((Objective("o_see", "f_see", {"clarity": 0.5}),)))}
    assert APP + "least" in named
    assert APP + "least" not in other
