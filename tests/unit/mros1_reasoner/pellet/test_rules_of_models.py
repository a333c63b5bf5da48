"""What a model's own rules conclude is what plain Pellet concludes of them, over models with rules of every kind.

Plain Pellet gets the whole model, rules as they are written, beside the vocabulary and rules in their published form:
with functional statuses, which rules conclude. The node gets what the knowledge base makes of the model. The
rule engine infers there what Pellet does.
"""

import random

import owlready2
import pytest
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.ontology_files import own_ontologies, read_knowledge_base, read_triples, save_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.loading import renamed
from mros1_reasoner.knowledge.model import Facts
from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError
from mros1_reasoner.knowledge.rules import rule_nodes
from mros1_reasoner.knowledge.triples import iri_of, write_ntriples
from mros1_reasoner.pellet.owlready import run_pellet
from ontology_text import APP, OWL, assertion, swrl, typed
from reasoner_helpers import OBJECTIVE, application

PUBLISHED = {
    "S1a": "solvesO(?fg, ?o), fg_status(?fg, 'IN_ERROR_COMPONENT') -> o_status(?o, 'IN_ERROR_COMPONENT')",
    "S1b": "solvesO(?fg, ?o), fg_status(?fg, 'IN_ERROR_NFR') -> o_status(?o, 'IN_ERROR_NFR')",
    "S6a": "requiresO(?fg, ?o), o_status(?o, 'IN_ERROR_NFR') -> fg_status(?fg, 'IN_ERROR_NFR')",
    "S6b": "requiresO(?fg, ?o), o_status(?o, 'IN_ERROR_COMPONENT') -> fg_status(?fg, 'IN_ERROR_COMPONENT')",
    "S9": "solvesO(?fg, ?o), typeFD(?fg, ?fd), o_status(?o, 'IN_ERROR_NFR') -> fd_error_log(?fd, ?o)",
    "compError": "mros:requiredBy(?c, ?fd), c_status(?c, 'FALSE') -> fd_realisability(?fd, false)",
    "compErrFG": "typeFD(?fg, ?fd), mros:requiredBy(?c, ?fd), c_status(?c, 'FALSE') -> "
    "fg_status(?fg, 'IN_ERROR_COMPONENT')",
    "compRecov": "c_status(?c, 'RECOVERED'), Objective(?o) -> o_status(?o, 'UPDATABLE')",
}
QUALITIES = ("safety", "energy", "clarity")
VIOLATED = {">": "greaterThan(?l, ?r)", "<": "lessThan(?l, ?r)"}
OF_ONE_TYPE = (
    "hasNFR(?o, ?n), solvesO(?fg, ?o), hasQAvalue(?fg, ?q), isQAtype(?n, app:{q}), isQAtype(?q, app:{q}), "
    "hasValue(?n, ?r), hasValue(?q, ?l), {how} -> o_status(?o, 'IN_ERROR_NFR')"
)
# Each with places for a quality and a level; those of more than one kind of atom, in heads and in bodies.
OWN_RULES = {
    "worse than expected": "hasQAvalue(?fg, ?q), isQAtype(?q, app:{q}), typeFD(?fg, ?fd), hasQAestimation(?fd, ?e), "
    "isQAtype(?e, app:{q}), hasValue(?q, ?l), hasValue(?e, ?r), lessThan(?l, ?r) -> fg_status(?fg, 'IN_ERROR_NFR')",
    "worse than expected, all": "FunctionGrounding(?fg), hasQAvalue(?fg, ?q), isQAtype(?q, ?t), typeFD(?fg, ?fd), "
    "hasQAestimation(?fd, ?e), isQAtype(?e, ?t), hasValue(?q, ?l), hasValue(?e, ?r), greaterThan(?l, ?r) -> "
    "fg_status(?fg, 'IN_ERROR_NFR')",
    "below": "hasQAvalue(?fg, ?q), isQAtype(?q, app:{q}), hasValue(?q, ?l), lessThan(?l, {level}), solvesO(?fg, ?o) -> "
    "o_status(?o, 'IN_ERROR_NFR')",
    "a cause": "hasQAvalue(?fg, ?q), isQAtype(?q, app:{q}), hasValue(?q, ?l), lessThan(?l, {level}) -> "
    "fg_cause(?fg, 'IN_ERROR_NFR')",
    "too much expected": "hasQAestimation(?fd, ?e), isQAtype(?e, app:{q}), hasValue(?e, ?l), greaterThan(?l, {level}) "
    "-> fd_realisability(?fd, false)",
    "fails with": "app:near(?c, ?d), c_status(?c, 'FALSE') -> c_status(?d, 'FALSE')",
    "failed once": "Component(?c), c_status(?c, 'FALSE'), app:near(?c, ?d), mros:requiredBy(?d, ?fd) -> "
    "fd_realisability(?fd, false)",
    "error of another": "o_status(?o, 'IN_ERROR_NFR'), app:beside(?o, ?p) -> o_status(?p, 'IN_ERROR_NFR')",
    "component of another": "o_status(?o, 'IN_ERROR_COMPONENT'), app:beside(?o, ?p), solvesO(?fg, ?p) -> "
    "fg_status(?fg, 'IN_ERROR_COMPONENT')",
    "waits": "o_status(?o, 'UNGROUNDED'), app:beside(?o, ?p) -> o_status(?p, 'UPDATABLE')",
    "works alone": "Component(?c), c_status(?c, 'TRUE'), app:near(?c, ?d), mros:requiredBy(?d, ?fd) -> "
    "app:peer(?fd, ?fd)",
    "with its peers": "fd_realisability(?fd, false), app:peer(?fd, ?other) -> fd_realisability(?other, false)",
    "given up": "fg_status(?fg, 'IN_ERROR_COMPONENT'), typeFD(?fg, ?fd) -> fd_realisability(?fd, false)",
    "tried": "fd_error_log(?fd, ?o), app:peer(?fd, ?other) -> fd_realisability(?other, false)",
    "not good enough": "hasNFR(?o, ?n), isQAtype(?n, app:{q}), hasValue(?n, ?r), typeF(?o, ?f), solvesF(?fd, ?f), "
    "hasQAestimation(?fd, ?e), isQAtype(?e, app:{q}), hasValue(?e, ?l), greaterThan(?l, ?r) -> "
    "fd_realisability(?fd, false)",
    "better now": "c_status(?c, 'RECOVERED'), mros:requiredBy(?c, ?fd), solvesF(?fd, ?f), typeF(?o, ?f) -> "
    "o_status(?o, 'UPDATABLE')",
}
DECLARED = [(name, "ObjectProperty") for name in ("near", "beside", "peer")]
RELATIONS = (
    ("near", "components", "components"),
    ("beside", "objectives", "objectives"),
    ("peer", "designs", "designs"),
)


@pytest.fixture(scope="module")
def published():
    """The vocabulary and its rules in their published form, but for QA, which is one rule for each quality."""
    triples = [triple for i, path in enumerate(own_ontologies()) for triple in renamed(read_triples(path), i)]
    rules = {s for s, _, o in triples if o == f"<{v.SWRL}Imp>"}
    gone = rule_nodes(triples, rules)
    lines = [t for t in triples if t[0] not in gone and iri_of(t[1]) != v.OWL_EQUIVALENT_PROPERTY]
    statuses = (v.O_STATUS, v.FG_STATUS, v.FD_REALISABILITY)
    functional = "".join(typed(name, v.OWL_FUNCTIONAL_PROPERTY) for name in statuses)
    return write_ntriples(lines) + functional + "".join(swrl(text, name) for name, text in PUBLISHED.items())


class Drawn:
    """A model drawn at random, and facts that fit it."""

    def __init__(self, seed):
        rng = random.Random(seed)
        names = {"designs": [f"d{i}" for i in range(4)], "components": ["c0", "c1", "c2"], "objectives": ["o0", "o1"]}
        self.directions = {quality: rng.choice("><") for quality in QUALITIES}
        self.function = dict(zip(names["designs"], ("f0", "f0", "f1", "f1"), strict=True))
        lines = [typed(f"{APP}{name}", OWL + kind) for name, kind in DECLARED]
        lines += [typed(f"{APP}{name}", v.FUNCTION) for name in ("f0", "f1")]
        lines += [typed(f"{APP}{name}", v.QA_TYPE) for name in QUALITIES]
        lines += [typed(f"{APP}{name}", v.COMPONENT) for name in names["components"]]
        for design in names["designs"]:
            lines += [
                typed(APP + design, v.FUNCTION_DESIGN),
                assertion(APP + design, v.SOLVES_F, APP + self.function[design]),
            ]
            for quality in QUALITIES:
                lines += self._level(f"{design}_{quality}", quality, rng)
                lines.append(assertion(APP + design, v.HAS_QA_ESTIMATION, f"{APP}{design}_{quality}"))
            for component in rng.sample(names["components"], rng.randint(0, 1)):
                lines.append(assertion(APP + component, v.REQUIRED_BY, APP + design))
        self.limits = {}
        for objective, function in (("o0", "f0"), ("o1", "f1")):
            lines += [typed(APP + objective, v.OBJECTIVE), assertion(APP + objective, v.TYPE_F, APP + function)]
            for quality in rng.sample(QUALITIES, rng.randint(0, 2)):
                lines += self._level(f"{objective}_{quality}", quality, rng)
                lines.append(assertion(APP + objective, v.HAS_NFR, f"{APP}{objective}_{quality}"))
        for relation, some, others in RELATIONS:
            for _ in range(rng.randint(0, 2)):
                lines.append(assertion(APP + rng.choice(names[some]), APP + relation, APP + rng.choice(names[others])))
        self.model = "".join(lines)
        self.rules = [OF_ONE_TYPE.format(q=quality, how=VIOLATED[how]) for quality, how in self.directions.items()]
        self.rules += rng.sample(sorted(PUBLISHED.values()), rng.randint(0, 3))
        for name in rng.sample(sorted(OWN_RULES), rng.randint(1, 4)):
            self.rules.append(OWN_RULES[name].format(q=rng.choice(QUALITIES), level=rng.choice((0.2, 0.5, 0.8))))
        groundings = {"o0": rng.choice(("d0", "d1"))} if rng.random() < 0.8 else {}
        groundings |= {"o1": rng.choice(("d2", "d3"))} if rng.random() < 0.6 else {}
        keys = [(name, quality) for name in groundings for quality in QUALITIES]
        self.observed = {
            "groundings": groundings,
            "levels": {
                key: rng.choice((0.1, 0.4, 0.6, 0.9)) for key in rng.sample(keys, min(len(keys), rng.randint(0, 2)))
            },
            "components": {
                name: rng.choice(("TRUE", "TRUE", "FALSE", "RECOVERED"))
                for name in names["components"][: rng.randint(0, 3)]
            },
            "requires": {"o0": ("o1",)} if "o0" in groundings and rng.random() < 0.3 else {},
        }

    @staticmethod
    def _level(name, quality, rng):
        return [
            typed(APP + name, v.QA_VALUE),
            assertion(APP + name, v.IS_QA_TYPE, APP + quality),
            assertion(APP + name, v.HAS_VALUE, rng.choice((0.3, 0.5, 0.7)), v.XSD + "decimal"),
        ]

    def text(self):
        return self.model + "".join(map(swrl, self.rules))

    def published_text(self):
        """Return the same in published names."""
        return self.model + "".join(swrl(rule.replace("fg_cause", "fg_status")) for rule in self.rules)

    def plain_facts(self, objectives):
        """Return the facts as a user of plain Pellet states them."""
        found = [
            Assertion(APP + name, v.C_STATUS, status, v.XSD + "string")
            for name, status in self.observed["components"].items()
        ]
        for name in objectives:
            design = self.observed["groundings"].get(name)
            if design is None:
                found.append(Assertion(APP + name, v.O_STATUS, v.UNGROUNDED, v.XSD + "string"))
                continue
            grounding = f"{v.RUNTIME}g_{name}"
            found.append(Assertion(grounding, v.RDF_TYPE, v.FUNCTION_GROUNDING))
            found += [Assertion(grounding, v.SOLVES_O, APP + name), Assertion(grounding, v.TYPE_FD, APP + design)]
            found += [
                Assertion(grounding, v.REQUIRES_O, APP + below) for below in self.observed["requires"].get(name, ())
            ]
            for (owner, quality), level in self.observed["levels"].items():
                if owner == name:
                    value = f"{grounding}_{quality}"
                    found += [Assertion(value, v.RDF_TYPE, v.QA_VALUE), Assertion(grounding, v.HAS_QA_VALUE, value)]
                    found.append(Assertion(value, v.IS_QA_TYPE, APP + quality))
                    found.append(Assertion(value, v.HAS_VALUE, str(level), v.XSD + "decimal"))
        return found


def statuses(rows):
    """Return status by objective, and the designs that can't be deployed or were tried."""
    found = {"o": {}, "unrealisable": set(), "tried": set()}
    for row in rows:
        name = row.subject.rpartition("#")[2]
        if row.property == v.O_STATUS and row.value != v.UNGROUNDED:
            found["o"].setdefault(name, set()).add(row.value)
        elif row.property == v.FD_REALISABILITY and row.value == "false":
            found["unrealisable"].add(name)
        elif row.property == v.FD_ERROR_LOG:
            found["tried"].add((name, row.value.rpartition("#")[2]))
    return found


ASKED = (v.O_STATUS, v.FD_REALISABILITY, v.FD_ERROR_LOG)


def judged(tmp_path, drawn, pellet, plain, published):
    """Return what plain Pellet concludes (None: a contradiction), what the node does, and the knowledge base."""
    (tmp_path / "app.owl").write_text(drawn.text())
    knowledge_base = read_knowledge_base([tmp_path / "app.owl"])
    facts = Facts(tuple(knowledge_base.objectives), **drawn.observed)
    plain.load(published + drawn.published_text())
    try:
        expected = statuses(plain.infer(drawn.plain_facts([o.name for o in facts.objectives]), ASKED))
    except InconsistentError:
        expected = None
    pellet.load(knowledge_base.ontology)
    analysis = knowledge_base.analyse(facts, pellet)
    engine = RuleEngine()
    engine.load(knowledge_base.ontology)
    assert knowledge_base.analyse(facts, engine) == analysis
    node = {
        "o": {name: set(found.causes) for name, found in analysis.objectives.items() if found.causes},
        "unrealisable": set(analysis.unrealisable),
        "tried": set(analysis.tried),
    }
    return expected, node, knowledge_base, facts


@pytest.mark.parametrize("part", range(8))
def test_node_concludes_what_plain_pellet_does(tmp_path, pellet, plain, published, part):
    consistent = 0
    for seed in range(part * 25, (part + 1) * 25):
        drawn = Drawn(seed)
        expected, node, _, _ = judged(tmp_path, drawn, pellet, plain, published)
        if expected is not None:
            consistent += 1
            assert node == expected, (seed, drawn.rules, drawn.observed)
    assert consistent >= 10


def test_ontologies_as_files_conclude_the_same_in_plain_owlready2(tmp_path, pellet):
    """A user opens the vocabulary, the rules and a model, states facts, and lets owlready2 call Pellet."""
    (tmp_path / "app.owl").write_text(application())
    knowledge_base = read_knowledge_base([tmp_path / "app.owl"])
    pellet.load(knowledge_base.ontology)
    components = {"laser": "FALSE", "camera": "RECOVERED"}
    known = Facts((OBJECTIVE,), {"o_move": "scan_slow"}, {("o_move", "energy"): 0.9}, components)
    analysis = knowledge_base.analyse(known, pellet)
    world = owlready2.World()
    for path in (*own_ontologies(), tmp_path / "app.owl"):
        world.get_ontology(path.as_uri()).load(only_local=True)
    app, tomasys = world.get_namespace("http://example.org/app#"), world.get_namespace(v.TOMASYS)
    with world.get_ontology("http://example.org/facts#"):
        o = tomasys.Objective("o_move", typeF=app.f_move)
        fg = tomasys.FunctionGrounding("fg", solvesO=o, typeFD=app.scan_slow)
        o.hasNFR = [tomasys.QAvalue("most", isQAtype=app.energy, hasValue=0.62)]
        fg.hasQAvalue = [tomasys.QAvalue("now", isQAtype=app.energy, hasValue=0.9)]
        app.energy.qa_sign = 1.0
        app.laser.c_status, app.camera.c_status = components["laser"], components["camera"]
    run_pellet(world)
    assert set(o.o_status) == analysis.objectives["o_move"].causes
    assert set(fg.fg_status) == analysis.objectives["o_move"].grounding_causes
    assert len(o.o_status) == 3
    found = {name for name in knowledge_base.designs if False in getattr(app, name).fd_realisability}
    assert found == set(analysis.unrealisable)
    assert True in o.o_updatable


@pytest.mark.parametrize("seed", range(4))
def test_saved_knowledge_base_concludes_the_same_in_plain_owlready2(tmp_path, pellet, plain, published, seed):
    drawn = Drawn(seed)
    _, node, knowledge_base, facts = judged(tmp_path, drawn, pellet, plain, published)
    world = knowledge_base.world(facts)
    run_pellet(world)
    names = {name: world[iri] for name, iri in ((o.name, APP + o.name) for o in facts.objectives)}
    found = {name: set(individual.o_status) - {v.UNGROUNDED} for name, individual in names.items()}
    assert {name: causes for name, causes in found.items() if causes} == node["o"]
    designs = {name for name in knowledge_base.designs if False in world[APP + name].fd_realisability}
    assert designs == node["unrealisable"]
    save_knowledge_base(tmp_path / "saved.owl", knowledge_base, facts)
    again = read_knowledge_base([tmp_path / "saved.owl"])
    pellet.load(again.ontology)
    assert again.analyse(facts, pellet) == knowledge_base.analyse(facts, pellet)
