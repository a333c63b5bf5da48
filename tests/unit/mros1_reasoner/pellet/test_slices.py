"""From a slice of an ontology follows what follows from the whole of it, over ontologies and models of every shape.

Plain Pellet gets each ontology as it is, with all individuals.
"""

import random
from dataclasses import replace

import pytest
from generated_ontologies import ALL, ASKED, BESIDE, NEAR, PEER, RIVAL, WEIGHT, facts, ontologies
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from mros1_reasoner.io.ontology_files import own_ontologies, read_knowledge_base, read_triples
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.loading import renamed
from mros1_reasoner.knowledge.model import Facts, Objective, Past
from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, ReasonerError
from mros1_reasoner.knowledge.triples import assertion_triple, parse_ntriples, write_ntriples
from mros1_reasoner.pellet import slices as slices_module
from mros1_reasoner.pellet.slices import SliceError, Slices
from ontology_text import APP, OWL, RDFS, assertion, swrl, typed
from reasoner_helpers import OBJECTIVE, application

DECIMAL, STRING = v.XSD + "decimal", v.XSD + "string"
SUM, MARKED, SEEN = f"{APP}sum_weight", f"{APP}Marked", f"{APP}Seen"
CLASSES = typed(MARKED, OWL + "Class") + typed(SEEN, OWL + "Class") + typed(SUM, OWL + "DatatypeProperty")
# What rules compare, compute and join, and what contradicts facts.
MORE = {
    "compared": swrl("app:weight(?x, ?w), greaterThan(?w, 1) -> app:peer(?x, ?x)"),
    "compared with another": swrl(
        "app:near(?x, ?y), app:weight(?x, ?w), app:weight(?y, ?u), lessThan(?w, ?u) -> app:peer(?x, ?y)"
    ),
    "computed and compared": swrl(
        "app:near(?x, ?y), app:weight(?x, ?w), multiply(?z, ?w, 2), greaterThan(?z, 3) -> app:rival(?y, ?x)"
    ),
    "computed and concluded": swrl("app:weight(?x, ?w), add(?z, ?w, ?w) -> app:sum_weight(?x, ?z)"),
    "a number": swrl("app:weight(?x, 2), app:near(?x, ?y) -> app:peer(?y, ?y)"),
    "the same number": swrl("app:weight(?x, ?w), app:weight(?y, ?w), app:near(?x, ?y) -> app:rival(?x, ?y)"),
    "numbers handed on": swrl("app:near(?x, ?y), app:weight(?x, ?w) -> app:sum_weight(?y, ?w)"),
    "one weight": typed(WEIGHT, v.OWL_FUNCTIONAL_PROPERTY),
    "one neighbour": typed(NEAR, v.OWL_FUNCTIONAL_PROPERTY),
    "classes": swrl("app:near(?x, ?y) -> app:Marked(?y)")
    + swrl("app:Seen(?x), app:beside(?y, ?x) -> app:peer(?y, ?x)"),
    "subclass": assertion(MARKED, RDFS + "subClassOf", SEEN),
    "range": assertion(NEAR, v.RDFS_RANGE, SEEN),
    "disjoint": assertion(MARKED, OWL + "disjointWith", f"{APP}Part"),
    "sub-property": assertion(BESIDE, RDFS + "subPropertyOf", NEAR),
    "inverse": assertion(PEER, OWL + "inverseOf", RIVAL),
    "chain": swrl("app:near(?x, ?y), app:peer(?y, ?z) -> app:peer(?x, ?z)"),
    "failures spread": swrl("c_status(?c, 'FALSE'), app:near(?c, ?x), app:near(?d, ?x) -> c_status(?d, 'FALSE')"),
}


@pytest.fixture(scope="module")
def vocabulary():
    """All of the generic rules."""
    return write_ntriples(t for i, path in enumerate(own_ontologies()) for t in renamed(read_triples(path), i))


@pytest.fixture
def both(pellet, plain):
    """Return a function: what follows from an ontology and facts, which is the same from their slice."""

    def infer(text, *cases, asked=ASKED):
        found = []
        for reasoner in (plain, pellet):
            try:
                reasoner.load(text)
            except InconsistentError:
                found.append("contradiction")
                continue
            found.append([conclusions(reasoner, known, asked) for known in cases])
        assert found[1] == found[0]
        return found[0]

    return infer


def conclusions(reasoner, known, asked):
    try:
        return reasoner.infer(known, asked)
    except InconsistentError:
        return "contradiction"
    except ReasonerError:
        return "a defect of Pellet"  # e.g. "Could not remove fact", where it tries whether individuals are the same


def weights():
    number = st.sampled_from(["1", "1.0", "2", "3.5"])
    one = st.builds(lambda name, text: Assertion(name, WEIGHT, text, DECIMAL), st.sampled_from(ALL), number)
    return st.lists(one, max_size=2)


@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    application=ontologies(of_rules=True),
    more=st.lists(st.sampled_from(sorted(MORE)), unique=True, max_size=3),
    cases=st.lists(st.tuples(facts(), weights()), min_size=2, max_size=3),
)
def test_inferences_are_those_of_the_whole_ontology(both, pellet, vocabulary, application, more, cases):
    cases = [[*known, *heavy] for known, heavy in cases]
    found = both(vocabulary + CLASSES + application + "".join(MORE[name] for name in more), *cases, asked=[*ASKED, SUM])
    for known, result in zip(cases, found, strict=False):
        sliced = found != "contradiction" and pellet._slices is not None and pellet._slices.of(known) is not None
        event(
            f"{'a slice' if sliced else 'the whole'}: {'contradiction' if 'contradiction' in (found, result) else 'ok'}"
        )


class Drawn:
    """A model drawn at random: hierarchies, roles, surroundings, bands, rules of its own; and facts that fit it."""

    RULES = (
        "c_status(?c, 'RECOVERED'), mros:requiredBy(?c, ?fd), solvesF(?fd, ?f), typeF(?o, ?f) "
        "-> o_cause(?o, 'UPDATABLE')",
        "hasQAvalue(?fg, ?q), isQAtype(?q, app:noise), typeFD(?fg, ?fd), hasQAestimation(?fd, ?e), "
        "isQAtype(?e, app:noise), hasValue(?q, ?l), hasValue(?e, ?r), greaterThan(?l, ?r) "
        "-> fg_cause(?fg, 'IN_ERROR_NFR')",
        "hasQAestimation(?fd, ?e), isQAtype(?e, app:noise), hasValue(?e, ?l), greaterThan(?l, 0.5) "
        "-> fd_realisability(?fd, false)",
        "app:beside(?c, ?d), c_status(?c, 'FALSE') -> c_status(?d, 'FALSE')",
        "fd_error_log(?fd, ?o), app:near(?fd, ?other) -> fd_realisability(?other, false)",
        "decision_from(?d, ?fd), decision_state(?d, 'FAILED'), decision_stamp(?d, ?t), greaterThan(?t, 5) "
        "-> fd_realisability(?fd, false)",
    )

    def __init__(self, seed):
        self.rng = rng = random.Random(seed)
        self.functions = [f"f{i}" for i in range(rng.randint(1, 3))]
        self.designs = {f"d{i}": rng.choice(self.functions) for i in range(rng.randint(4, 14))}
        self.components = [f"c{i}" for i in range(rng.randint(2, 5))]
        parts = [(f"own_{name}", [name]) for name in self.designs if rng.random() < 0.5]
        parts += [(name, rng.sample(sorted(self.designs), rng.randint(0, 4))) for name in self.components]
        self.components += [name for name, _ in parts if name.startswith("own")]
        lines = [typed(APP + name, OWL + "ObjectProperty") for name in ("near", "beside")]
        lines += [typed(APP + name, v.FUNCTION) for name in self.functions]
        lines += [typed(APP + "noise", v.QA_TYPE), assertion(APP + "noise", v.QA_SIGN, 1, DECIMAL)]
        lines += [typed(APP + name, v.COMPONENT) for name in self.components]
        lines += [typed(APP + name, v.ENVIRONMENT_ATTRIBUTE) for name in ("light", "slope")]
        lines += [assertion(APP + name, v.REQUIRED_BY, APP + design) for name, designs in parts for design in designs]
        for name, function in self.designs.items():
            lines += [typed(APP + name, v.FUNCTION_DESIGN), assertion(APP + name, v.SOLVES_F, APP + function)]
            lines += [assertion(APP + name, v.HAS_QA_ESTIMATION, f"{APP}{name}_noise")]
            lines += [
                typed(f"{APP}{name}_noise", v.QA_VALUE),
                assertion(f"{APP}{name}_noise", v.IS_QA_TYPE, APP + "noise"),
            ]
            lines += [assertion(f"{APP}{name}_noise", v.HAS_VALUE, rng.choice((0.2, 0.4, 0.6)), DECIMAL)]
            below = self.functions[self.functions.index(function) + 1 :]
            lines += [assertion(APP + name, v.REQUIRES_F, APP + f) for f in below if rng.random() < 0.5]
            if rng.random() < 0.4:
                need, end = f"{APP}need_{name}", rng.choice((v.ENV_LEAST, v.ENV_MOST))
                lines += [typed(need, v.TOMASYS + "EnvironmentConstraint"), assertion(need, end, 0.5, DECIMAL)]
                lines += [assertion(need, v.CONSTRAINS, APP + rng.choice(("light", "slope")))]
                lines += [assertion(APP + name, v.REQUIRES_ENVIRONMENT, need)]
            if rng.random() < 0.3:
                lines.append(assertion(APP + name, v.TOMASYS + "roles", APP + "looking"))
        lines += [typed(APP + "looking", v.TOMASYS + "Role"), typed(APP + "eyes", v.TOMASYS + "ComponentClass")]
        lines += [typed(APP + "spec", v.COMPONENT_SPECIFICATION), typed(APP + "eye", v.COMPONENT_STATE)]
        lines += [assertion(APP + "looking", v.TOMASYS + "roleDef", APP + "spec")]
        lines += [assertion(APP + name, v.TOMASYS + "typeC", APP + "eyes") for name in ("spec", "eye")]
        lines += [assertion(APP + "eyes", v.TOMASYS + "cc_unique", "true", v.XSD + "boolean")]
        lines += [
            assertion(APP + rng.choice(names), APP + relation, APP + rng.choice(names))
            for relation, names in (("near", sorted(self.designs)), ("beside", self.components))
            for _ in range(rng.randint(0, 3))
        ]
        self.text = "".join(lines) + "".join(map(swrl, rng.sample(self.RULES, rng.randint(0, 3))))

    def facts(self, quality):
        rng = self.rng
        objectives, groundings, requires = [], {}, {}
        for function in self.functions:
            limits = rng.choice(({}, {"noise": 0.5}, quality.band("noise", 0.3, 0.5)))
            objectives.append(Objective(f"o_{function}", function, limits))
            solving = [name for name, solved in self.designs.items() if solved == function]
            if solving and rng.random() < 0.8:
                groundings[f"o_{function}"] = rng.choice(solving)
        if len(groundings) > 1 and rng.random() < 0.5:
            above, below = list(groundings)[:2]
            requires = {above: (below,)}
        statuses = ("TRUE", "TRUE", "FALSE", "RECOVERED")
        some = rng.sample([*self.components, "eye"], rng.randint(0, 3))
        past = Past("p1", objectives[0].name, rng.choice(sorted(self.designs)), "", "FAILED", rng.choice((3.0, 7.0)))
        return Facts(
            objectives=tuple(objectives),
            groundings=groundings,
            levels={(name, "noise"): rng.choice((0.1, 0.4, 0.7)) for name in groundings if rng.random() < 0.6},
            components={name: rng.choice(statuses) for name in some},
            broken=frozenset(name for name in groundings if rng.random() < 0.1),
            failed=frozenset(name for name in groundings if rng.random() < 0.2),
            requires=requires,
            tried=frozenset({(rng.choice(sorted(self.designs)), objectives[0].name)} if rng.random() < 0.3 else ()),
            history=(past,) if rng.random() < 0.3 else (),
            surroundings={name: rng.choice((0.2, 0.8)) for name in ("light", "slope") if rng.random() < 0.5},
        )


SEEDS = 12


@pytest.mark.parametrize("part", range(4))
def test_analyses_are_those_of_the_whole_ontology(tmp_path, pellet, plain, part):
    sliced = 0
    for seed in range(part * SEEDS, (part + 1) * SEEDS):
        drawn = Drawn(seed)
        (tmp_path / "app.owl").write_text(drawn.text)
        knowledge_base = read_knowledge_base([tmp_path / "app.owl"])
        knowledge_base.admit("noise_min")
        for reasoner in (pellet, plain):
            reasoner.load(knowledge_base.ontology)
        sliced += pellet._slices is not None
        for _ in range(3):
            known = drawn.facts(knowledge_base.qualities["noise"])
            assert knowledge_base.analyse(known, pellet) == knowledge_base.analyse(known, plain), (seed, known)
    assert sliced == SEEDS


def read(load, count=30):
    """Return a knowledge base of designs of which no two are alike, since each has a part of its own."""
    designs = {f"d{i}": ({}, ["laser" if i % 3 else "camera", f"part{i}"]) for i in range(count)}
    return load(application(designs))


def slices(knowledge_base):
    return Slices(list(parse_ntriples(knowledge_base.ontology)))


def named(part):
    return {statement.subject.rpartition("#")[2] for statement in part.statements}


def test_nothing_is_said_of_designs_that_nothing_has_happened_to(load):
    knowledge_base = read(load)
    known = Facts((OBJECTIVE,), {"o_move": "d1"}, {("o_move", "safety"): 0.9}, {"laser": "TRUE", "part3": "TRUE"})
    part = slices(knowledge_base).of(knowledge_base.assertions(known))
    assert "d1" in named(part)
    assert not named(part) & {f"d{i}" for i in range(30) if i != 1}


def test_designs_that_differ_in_parts_that_work_are_one(load):
    knowledge_base = read(load)
    part = slices(knowledge_base).of(knowledge_base.assertions(Facts((OBJECTIVE,), components={"laser": "FALSE"})))
    assert len(named(part) & {f"d{i}" for i in range(30)}) == 1
    expand = part.individuals.split([])[1]
    assert max(map(len, expand.members.values())) == 20


def test_numbers_that_rules_only_compare_need_no_new_slice(load):
    knowledge_base = read(load)
    found = slices(knowledge_base)
    levels = [0.1, 0.5, 0.9]
    cases = [Facts((OBJECTIVE,), {"o_move": "d1"}, {("o_move", "safety"): level}) for level in levels]
    parts = [found.of(knowledge_base.assertions(known)) for known in cases]
    assert parts[0] is parts[1] is parts[2]
    assert found.of(knowledge_base.assertions(replace(cases[0], components={"laser": "FALSE"}))) is not parts[0]


@pytest.mark.parametrize("name", ["a number", "the same number", "numbers handed on", "compared"])
def test_numbers_that_rules_join_by_are_told_apart(both, pellet, name):
    text = CLASSES + typed(WEIGHT, OWL + "DatatypeProperty") + MORE[name]
    text += "".join(typed(relation, OWL + "ObjectProperty") for relation in (NEAR, PEER, RIVAL))
    text += "".join(typed(APP + individual, SEEN) for individual in "abc") + assertion(f"{APP}a", NEAR, f"{APP}b")
    text += assertion(f"{APP}b", WEIGHT, "2", DECIMAL)
    cases = [[Assertion(f"{APP}a", WEIGHT, number, DECIMAL)] for number in ("2", "3")]
    both(text, *cases, asked=[PEER, RIVAL, SUM])
    parts = [pellet._slices.of(known) for known in cases]
    assert (parts[0] is parts[1]) == (name == "compared")


def test_slices_of_facts_that_were_long_ago_are_forgotten(load):
    knowledge_base = read(load)
    found = slices(knowledge_base)
    for i in range(30):
        found.of(knowledge_base.assertions(Facts((OBJECTIVE,), {"o_move": f"d{i}"})))
    assert len(found._latest) < 30


def test_statements_from_which_a_statement_follows_are_in_the_slice(both):
    text = (
        typed(f"{APP}Part", OWL + "Class") + typed(BESIDE, OWL + "ObjectProperty") + typed(NEAR, OWL + "ObjectProperty")
    )
    text += "".join(typed(APP + name, f"{APP}Part") for name in "abcd") + assertion(
        BESIDE, RDFS + "subPropertyOf", NEAR
    )
    text += assertion(f"{APP}a", BESIDE, f"{APP}b") + assertion(f"{APP}c", BESIDE, f"{APP}d")
    text += typed(PEER, OWL + "ObjectProperty") + swrl("app:near(?x, ?y), app:peer(?z, ?x) -> app:peer(?z, ?y)")
    known = [Assertion(f"{APP}d", PEER, f"{APP}a")]
    assert {a.value for a in both(text, known, asked=[PEER])[0]} == {f"{APP}a", f"{APP}b"}
    part = Slices(list(parse_ntriples(text))).of(known)
    assert assertion_triple(Assertion(f"{APP}a", BESIDE, f"{APP}b")) in map(assertion_triple, part.statements)
    assert f"{APP}c" not in {statement.subject for statement in part.statements}


@pytest.mark.parametrize(
    ("more", "what"),
    [
        (typed(NEAR, OWL + "InverseFunctionalProperty"), "InverseFunctionalProperty"),
        (assertion(f"{APP}a", OWL + "sameAs", f"{APP}b"), "sameAs"),
        (swrl("app:weight(?x, ?w), add(?z, ?w, ?w) -> app:sum_weight(?x, ?z)"), "a rule concludes what no statement"),
        (swrl("app:near(?x, ?y), app:unknown(?y, ?x) -> app:near(?y, ?x)"), "a rule is about unknown"),
        (assertion(f"{APP}a", NEAR, f"{APP}b") + MORE["one neighbour"] + assertion(f"{APP}a", NEAR, f"{APP}c"), "near"),
    ],
)
def test_ontologies_that_slices_may_lack_something_of_are_told(more, what):
    text = CLASSES + typed(NEAR, OWL + "ObjectProperty") + typed(WEIGHT, OWL + "DatatypeProperty")
    text += "".join(typed(APP + name, SEEN) for name in "abc")
    with pytest.raises(SliceError, match=what):
        Slices(list(parse_ntriples(text + more)))


def test_rules_that_join_too_much_get_no_slices(monkeypatch, load):
    knowledge_base = read(load)
    known = knowledge_base.assertions(Facts((OBJECTIVE,), components={"laser": "FALSE"}))
    found = slices(knowledge_base)
    monkeypatch.setattr(slices_module, "MOST_STEPS", 5)
    assert found.of(known) is None
    with pytest.raises(SliceError, match="join too much"):
        slices(knowledge_base)


def test_facts_that_may_make_two_individuals_the_same_are_for_the_whole_ontology(both, pellet):
    text = (
        typed(f"{APP}Part", OWL + "Class") + typed(NEAR, OWL + "ObjectProperty") + typed(PEER, OWL + "ObjectProperty")
    )
    text += "".join(typed(APP + name, f"{APP}Part") for name in "abcd") + MORE["one neighbour"]
    text += assertion(f"{APP}a", NEAR, f"{APP}b") + assertion(f"{APP}c", PEER, f"{APP}b")
    fine, same = [Assertion(f"{APP}d", NEAR, f"{APP}a")], [Assertion(f"{APP}a", NEAR, f"{APP}d")]
    found = both(text, fine, same, fine, asked=[PEER])
    assert pellet._slices.of(fine) is not None
    assert pellet._slices.of(same) is None
    assert len(found[1]) > len(found[0]) == len(found[2])


def test_fact_that_contradicts_a_statement_is_found(both, pellet):
    text = typed(f"{APP}Part", OWL + "Class") + typed(WEIGHT, OWL + "DatatypeProperty") + MORE["one weight"]
    text += "".join(typed(APP + name, f"{APP}Part") for name in "ab")
    text += assertion(f"{APP}a", WEIGHT, "2", DECIMAL)
    cases = [[Assertion(f"{APP}{name}", WEIGHT, "3", DECIMAL)] for name in "ab"]
    found = both(text, *cases, asked=[WEIGHT])
    assert all(pellet._slices.of(known) is not None for known in cases)
    assert found[0] == "contradiction"
    assert len(found[1]) == 2
