"""The TOMASys knowledge base: facts and statuses by name, assertions for a reasoner."""

from __future__ import annotations

import io
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import owlready2

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import (
    LEAST,
    MOST,
    Analysis,
    Design,
    Facts,
    Objective,
    ObjectiveAnalysis,
    Past,
    Repair,
)
from mros1_reasoner.knowledge.model_reader import ApplicationModel, KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import Assertion, Reasoner
from mros1_reasoner.knowledge.scale import Scale
from mros1_reasoner.knowledge.triples import assertion_triple, decimal_text, local_name, write_ntriples

_DECIMAL = v.XSD + "decimal"
_STRING = v.XSD + "string"


class KnowledgeBase:
    """The content of the models. It never changes, but for the ends of bands that `admit` adds.

    Attributes:
        functions: names of all functions.
        designs: every design by name, with its expected levels.
        components: names of all components.
        own_nodes: components that are nothing but nodes of designs; no generic rule is about them.
        unread: components whose status no rule reads.
        levels_read: quality attributes whose observed levels rules of the models read.
        reads_error_log: whether rules of the models read which designs have failed.
        environment: names of the properties of the surroundings.
        reads_environment: whether rules of the models read their values.
        reads_history: whether rules of the models read which decisions there were.
        qualities: how levels compare, of every quality attribute by name.
        objectives: those that the models hold already, but for those that a grounding requires.
        component_statuses: statuses that the models assert.
        repairs: how components are repaired, by the component's name.
        files: all that was loaded, imports included, but for the package's own vocabulary.
        ontology: vocabulary, rules and models as N-Triples, without what comes as facts, without rules that can
            conclude nothing in these models, and without repairs of which no rule reads.
    """

    def __init__(self, model: ApplicationModel, files: Sequence[Path] = ()) -> None:
        """Hold a model, and name the files that it was read from."""
        self._model = model
        self._design_name = {iri: name for name, iri in model.design_iris.items()}
        self._component_name = {iri: name for name, iri in model.component_iris.items()}
        self.functions = tuple(sorted(model.function_iris))
        self.designs: Mapping[str, Design] = model.designs
        self.components = frozenset(model.component_iris)
        self.own_nodes = model.own_nodes
        self.unread = frozenset() if model.reads.properties & {v.C_STATUS, v.DEPLOYED_BY} else model.own_nodes
        self.levels_read = frozenset(
            name
            for name, iri in model.quality_iris.items()
            if model.reads.every_quality or iri in model.reads.qualities
        )
        self.reads_error_log = v.FD_ERROR_LOG in model.reads.properties
        self.environment = frozenset(model.environment_iris)
        self.reads_environment = v.ENV_VALUE in model.reads.properties
        self.reads_history = not model.reads.properties.isdisjoint({v.DECISION, *v.HISTORY})
        self._labels = model.reads.labels
        self.qualities = dict(model.qualities)
        self._other_end: dict[str, str] = {}  # of a band, by quality
        self.objectives = model.objectives
        self.component_statuses = model.component_statuses
        self.repairs: Mapping[str, Repair] = model.repairs
        self.files = tuple(files)
        self.ontology = model.ontology
        self._scales: dict[str, Scale] = {}
        self._fills = model.fills
        for objective in model.objectives:
            for quality in objective.limits:
                self.admit(quality)

    def admit(self, quality: str) -> bool:
        """Return whether there may be a limit of that name: of a quality, or of the other side of its band."""
        base = quality.removesuffix(LEAST) if quality.endswith(LEAST) else quality.removesuffix(MOST)
        kind = self.qualities.get(base)
        if quality in self.qualities or kind is None or kind.other_end(base) != quality:
            return quality in self.qualities
        self.qualities[quality] = replace(kind, direction=kind.direction.opposite, typical="")
        self._other_end[base] = quality
        self.designs = {name: _with_end(design, base, quality) for name, design in self.designs.items()}
        return True

    def limits_by(self, quality: str) -> tuple[str, ...]:
        """Return the names of the limits that the observed levels of a quality may violate."""
        return (quality, *filter(None, (self._other_end.get(quality),)))

    def rules_for(self, status: str) -> str:
        """Return how to call the rules of the models that conclude a status."""
        names = self._labels.get(status, ())
        return f"rule {' or '.join(names)} of the model" if names else "a rule of the model"

    def scale(self, quality: str) -> Scale:
        """Return how levels of a quality are compared: by all that are expected of designs."""
        if quality not in self._scales:
            expected = [design.expected[quality] for design in self.designs.values() if quality in design.expected]
            kind = self.qualities[quality]
            self._scales[quality] = Scale.of(kind.direction, expected, kind.low)
        return self._scales[quality]

    def solving(self, function: str) -> tuple[Design, ...]:
        """Return the designs that solve a function, by name."""
        return tuple(design for design in self.designs.values() if design.function == function)

    def grounding(self, objective: str, design: str) -> str:
        """Return the name of the grounding of an objective by a design, as diagnostics have it.

        Groundings of several objectives may have one name where no model names them; in the ontology, they differ.
        """
        iri = self._model.grounding_iris.get((objective, design), v.RUNTIME)
        return f"fg_{objective}_{design}" if iri.startswith(v.RUNTIME) else local_name(iri)

    def assertions(self, facts: Facts, *, all_components: bool = False) -> list[Assertion]:
        """Return the facts as assertions for a reasoner.

        Args:
            facts: what is known.
            all_components: assert also of components that they work, though no rule reads that.

        Raises:
            KnowledgeBaseError: a fact names something that the models do not hold.
        """
        result = list(self._ends_of_bands())
        for objective in facts.objectives:
            result += self._about(objective, facts)
        says_working = self._model.reads.working or all_components
        for component, status in sorted(facts.components.items()):
            iri = self._find(self._model.component_iris, component, "Component")
            if says_working or status != v.WORKS:
                result.append(Assertion(iri, v.C_STATUS, status, _STRING))
        for design, objective_name in sorted(facts.tried):
            iri = self._find(self._model.design_iris, design, "FunctionDesign")
            result.append(Assertion(iri, v.FD_ERROR_LOG, self._objective_iri(objective_name)))
        for attribute, value in sorted(facts.surroundings.items()):
            iri = self._find(self._model.environment_iris, attribute, "EnvironmentAttribute")
            result.append(Assertion(iri, v.RDF_TYPE, v.ENVIRONMENT_ATTRIBUTE))
            result.append(Assertion(iri, v.ENV_VALUE, decimal_text(value), _DECIMAL))
        for past in facts.history:
            result += self._past(past)
        return result

    def _about(self, objective: Objective, facts: Facts) -> Iterator[Assertion]:
        """Yield what facts say of an objective, and of what is deployed for it."""
        iri = self._objective_iri(objective.name)
        yield Assertion(iri, v.RDF_TYPE, v.OBJECTIVE)
        yield Assertion(iri, v.TYPE_F, self._find(self._model.function_iris, objective.function, "Function"))
        for quality, limit in sorted(objective.limits.items()):
            value = self._nfr_iri(objective, quality)
            yield from (Assertion(iri, v.HAS_NFR, value), *self._level(value, quality, limit))
        design = facts.groundings.get(objective.name)
        if design is None:
            yield Assertion(iri, v.O_STATUS, v.UNGROUNDED, _STRING)
            return
        grounding = self._grounding_iri(objective.name, design)
        yield Assertion(grounding, v.RDF_TYPE, v.FUNCTION_GROUNDING)
        yield Assertion(grounding, v.SOLVES_O, iri)
        yield Assertion(grounding, v.TYPE_FD, self._find(self._model.design_iris, design, "FunctionDesign"))
        for binding in self._model.bindings.of_designs.get(design, ()):
            yield Assertion(grounding, v.HAS_BINDINGS, binding)
        for required in facts.requires.get(objective.name, ()):
            yield Assertion(grounding, v.REQUIRES_O, self._objective_iri(required))
        if objective.name in facts.failed:
            yield Assertion(iri, v.O_CAUSE, v.IN_ERROR_NFR, _STRING)
        if objective.name in facts.broken:
            yield Assertion(grounding, v.FG_CAUSE, v.IN_ERROR_COMPONENT, _STRING)
        for (owner, quality), level in sorted(facts.levels.items()):
            if owner == objective.name:
                value = _own_iri("level", objective.name, quality)
                yield from (Assertion(grounding, v.HAS_QA_VALUE, value), *self._level(value, quality, level))

    def analyse(self, facts: Facts, reasoner: Reasoner) -> Analysis:
        """Infer the causes that follow from the facts, and derive the statuses.

        Args:
            facts: what is known now.
            reasoner: it must have loaded `ontology`.

        Raises:
            ReasonerError: the reasoner failed, or the ontology contradicts itself.
            KnowledgeBaseError: a fact names something that the models do not hold.
        """
        found: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
        for assertion in reasoner.infer(self.assertions(facts), self._model.asked):
            found[assertion.property][assertion.subject].add(assertion.value)
        names = {self._objective_iri(objective.name): objective.name for objective in facts.objectives}
        objectives = {}
        for objective in facts.objectives:
            iri = self._objective_iri(objective.name)
            causes = frozenset(found[v.O_CAUSE][iri] - {v.UNGROUNDED, v.IN_PROGRESS})
            violated_values = found[v.O_VIOLATED_NFR][iri]
            design = facts.groundings.get(objective.name)
            grounding_causes = found[v.FG_CAUSE][self._grounding_iri(objective.name, design)] if design else set()
            objectives[objective.name] = ObjectiveAnalysis(
                status=_worst(causes) or (v.IN_PROGRESS if design else v.UNGROUNDED),
                causes=causes,
                violated=tuple(q for q in sorted(objective.limits) if self._nfr_iri(objective, q) in violated_values),
                grounding_causes=frozenset(grounding_causes),
                grounding_status=_worst(grounding_causes),
            )
        return Analysis(
            objectives=objectives,
            unrealisable=self._unrealisable(found),
            tried=frozenset(
                (self._design_name[design], names[objective])
                for design, tried_for in found[v.FD_ERROR_LOG].items()
                for objective in tried_for
                if design in self._design_name and objective in names
            ),
        )

    def _unrealisable(self, found: Mapping[str, Mapping[str, set[str]]]) -> dict[str, tuple[str, ...]]:
        """Return the designs that can't be deployed, each with the components that are missing."""
        bindings = self._model.bindings
        lost = {binding for binding, values in found[v.B_STATUS].items() if "false" in values}
        others = {*self._model.function_iris.values(), *self._model.environment_iris.values(), *self._fills}
        by_rule = (iri for iri, values in found[v.FD_REALISABILITY].items() if "false" in values)
        by_binding = (self._model.design_iris[name] for name, own in bindings.of_designs.items() if lost & {*own})
        alike: dict[tuple[frozenset[str], frozenset[str]], tuple[str, ...]] = {}  # many designs miss the same
        result = {}
        for iri in dict.fromkeys([*found[v.FD_UNREALISABLE_BY], *by_rule, *by_binding]):
            name = self._design_name.get(iri)
            if name is None:
                continue
            missing, own = frozenset(found[v.FD_UNREALISABLE_BY][iri]), frozenset(bindings.of_designs.get(name, ()))
            if (missing, own) not in alike:
                filling = {frozenset() if own & all_of_it else all_of_it for all_of_it in map(self._filling, missing)}
                broken = {bindings.components[binding] for binding in lost & own.union(*filling)}
                names = {self._component_name.get(what, local_name(what)) for what in missing - others}
                alike[missing, own] = tuple(sorted(names | broken))
            result[name] = alike[missing, own]
        return result

    def _filling(self, what: str) -> frozenset[str]:
        return self._fills.get(what, frozenset())

    def world(self, facts: Facts | None = None, analysis: Analysis | None = None) -> owlready2.World:
        """Return an owlready2 World of its own with the ontology, the facts, and the statuses of an analysis."""
        triples = [assertion_triple(assertion) for assertion in self.assertions(facts or Facts(), all_components=True)]
        if facts and analysis:
            triples += [assertion_triple(assertion) for assertion in self._statuses(facts, analysis)]
        for design in self.designs.values():
            for quality, level in sorted(design.expected.items()):
                if quality in self._other_end.values():
                    continue
                design_iri = self._model.design_iris[design.name]
                iri = self._model.level_iris[design_iri, quality, level]
                triples.append(assertion_triple(Assertion(design_iri, v.HAS_QA_ESTIMATION, iri)))
                triples += [assertion_triple(assertion) for assertion in self._level(iri, quality, level)]
                if group := design.group(quality):
                    triples.append(assertion_triple(Assertion(iri, v.QA_CORRECTION_GROUP, group, _STRING)))
        world = owlready2.World()
        text = self.ontology + self._model.idle + write_ntriples(triples)
        world.get_ontology(v.RUNTIME).load(fileobj=io.BytesIO(text.encode()), format="ntriples")
        return world

    def rdf_xml(self, facts: Facts | None = None, analysis: Analysis | None = None) -> bytes:
        """Return models, facts and statuses as RDF/XML that loads again as a model."""
        world, text = self.world(facts, analysis), io.BytesIO()
        try:
            world.get_ontology(v.RUNTIME).save(text, format="rdfxml")
        finally:
            world.close()
        return text.getvalue()

    # Names and IRIs

    def _find(self, iris: Mapping[str, str], name: str, kind: str) -> str:
        if name not in iris:
            raise KnowledgeBaseError(f"{self._model.where}: no {kind} is called {name!r}")
        return iris[name]

    def _objective_iri(self, name: str) -> str:
        return self._model.objective_iris.get(name) or f"{v.RUNTIME}{name}"

    def _grounding_iri(self, objective: str, design: str) -> str:
        return self._model.grounding_iris.get((objective, design)) or _own_iri("fg", objective, design)

    def _nfr_iri(self, objective: Objective, quality: str) -> str:
        """Return the IRI of a limit: that of the model, unless somebody has set another limit."""
        iri, limit = self._objective_iri(objective.name), objective.limits[quality]
        own = None if quality in self._other_end.values() else self._model.level_iris.get((iri, quality, limit))
        return own or _own_iri("nfr", objective.name, quality, repr(limit))  # a saved model has that of another limit

    def _past(self, past: Past) -> Iterable[Assertion]:
        iri, objective = f"{v.RUNTIME}{past.name}", self._objective_iri(past.objective)
        yield Assertion(iri, v.RDF_TYPE, v.DECISION)
        yield Assertion(objective, v.RDF_TYPE, v.OBJECTIVE)  # it may have been given up
        yield Assertion(iri, v.DECISION_OBJECTIVE, objective)
        for name, design in ((v.DECISION_FROM, past.source), (v.DECISION_TO, past.target)):
            if design:
                yield Assertion(iri, name, self._find(self._model.design_iris, design, "FunctionDesign"))
        yield Assertion(iri, v.DECISION_STATE, past.state, _STRING)
        yield Assertion(iri, v.DECISION_STAMP, decimal_text(past.stamp), _DECIMAL)
        for cause in past.causes:
            yield Assertion(iri, v.DECISION_CAUSE, cause, _STRING)

    def _ends_of_bands(self) -> Iterable[Assertion]:
        """Yield the types of levels that are compared with the limits on the other side of bands."""
        for quality in self._other_end.values():
            iri, kind = f"{v.RUNTIME_LIMITS}{quality}", self.qualities[quality]
            yield Assertion(iri, v.RDF_TYPE, v.QA_TYPE)
            yield Assertion(iri, v.QA_SIGN, str(kind.direction.sign), _DECIMAL)
            if kind.reaching_violates:
                yield Assertion(iri, v.QA_REACHING_VIOLATES, "true", v.XSD + "boolean")

    def _quality_iri(self, quality: str) -> str:
        if quality in self._other_end.values():
            return f"{v.RUNTIME_LIMITS}{quality}"
        return self._find(self._model.quality_iris, quality, "QualityAttributeType")

    def _level(self, iri: str, quality: str, level: float) -> list[Assertion]:
        if not math.isfinite(level):
            raise KnowledgeBaseError(f"level of {quality} is {level}: it must be a finite number")
        return [
            Assertion(iri, v.RDF_TYPE, v.QA_VALUE),
            Assertion(iri, v.IS_QA_TYPE, self._quality_iri(quality)),
            Assertion(iri, v.HAS_VALUE, decimal_text(level), _DECIMAL),
        ]

    def _statuses(self, facts: Facts, analysis: Analysis) -> Iterable[Assertion]:
        for name, objective in analysis.objectives.items():
            for status in sorted(objective.causes) or [objective.status]:
                yield Assertion(self._objective_iri(name), v.O_STATUS, status, _STRING)
            updatable = "true" if v.UPDATABLE in objective.causes else "false"
            yield Assertion(self._objective_iri(name), v.O_UPDATABLE, updatable, v.XSD + "boolean")
            for status in sorted(objective.grounding_causes):
                grounding = self._grounding_iri(name, facts.groundings[name])
                yield Assertion(grounding, v.FG_STATUS, status, _STRING)
        for name, iri in self._model.design_iris.items():
            realisable = "false" if name in analysis.unrealisable else "true"
            yield Assertion(iri, v.FD_REALISABILITY, realisable, v.XSD + "boolean")


def _own_iri(kind: str, *names: str) -> str:
    """Return the IRI of an individual that belongs to others; no other names, and no objective, have the same one."""
    return v.RUNTIME + "/".join([kind, *(name.replace("%", "%25").replace("/", "%2F") for name in names)])


def _with_end(design: Design, quality: str, other: str) -> Design:
    """Return a design with the expected level of a quality under the name of the other limit of its band, too."""
    if quality not in design.expected:
        return design
    groups = {**design.groups, other: design.group(quality)} if design.group(quality) else design.groups
    return replace(design, expected={**design.expected, other: design.expected[quality]}, groups=groups)


def _worst(causes: Iterable[str]) -> str:
    found = set(causes)
    return next((cause for cause in (v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR, v.UPDATABLE) if cause in found), "")
