"""The application's model, read from the triples of its ontologies."""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from node_kit.one_line import OneLineError

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.bindings import BindingError, Bindings, order, read_bindings, rebound
from mros1_reasoner.knowledge.live_rules import without_idle
from mros1_reasoner.knowledge.loaded_rules import Reads
from mros1_reasoner.knowledge.model import LEAST, MOST, Design, Direction, Need, Objective, Quality, Repair
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.repairs import PROPERTIES, RepairError, about_repairs, read_repairs
from mros1_reasoner.knowledge.triples import (
    Graph,
    Triple,
    assertion_triple,
    decimal_text,
    iri_of,
    literal_of,
    local_name,
    write_ntriples,
)

_log = logging.getLogger(__name__)

_DECIMAL = v.XSD + "decimal"
# Statements that hold at one moment only. They come as facts of each analysis, so the ontology goes without them.
_MOMENTARY = (
    *(v.O_STATUS, v.FG_STATUS, v.O_CAUSE, v.FG_CAUSE, v.O_VIOLATED_NFR, v.O_UPDATABLE),
    *(v.FD_REALISABILITY, v.FD_UNREALISABLE_BY, v.F_FULFILLABLE, v.FD_NONE_SO_FAR, v.FD_ERROR_LOG),
    *(v.C_STATUS, v.SOLVES_O, v.TYPE_FD, v.REQUIRES_O, v.ENV_VALUE),
    *(v.B_STATUS, v.B_FAILURES, v.ROLE_AVAILABILITY, v.CC_AVAILABILITY, v.CSPEC_AVAILABILITY),
)
# They are stated anew, of all designs and bindings that are read.
_ORDER = (v.F_FIRST_DESIGN, v.F_LAST_DESIGN, v.FD_NEXT, v.B_NEXT, v.ROLE_LAST_BINDING, v.ROLE_SPARES)
_COMPARISONS = (v.QA_SIGN, v.QA_COMPARISON_OPERATOR, v.QA_REACHING_VIOLATES)
_OF_NODES = (v.RDF_TYPE, v.RDFS_LABEL, v.C_STATUS, v.DEPLOYED_BY, v.REPAIRS)
_OF_REPAIRS = (v.REPAIR, *PROPERTIES)
_OWN = (v.RUNTIME, v.RUNTIME_LIMITS)
_DEEPEST = 100  # levels of functions that require functions
_SHOWN = 5  # functions of a chain, in messages
_LEVELS = (v.HAS_NFR, v.HAS_QA_VALUE, v.HAS_QA_ESTIMATION, v.HAS_VALUE, v.IS_QA_TYPE)


class KnowledgeBaseError(OneLineError):
    """The models can't be used; one line that says which file or individual, why, and what to do."""


@dataclass(frozen=True)
class ApplicationModel:
    """What the ontologies of an application say.

    Attributes:
        where: the files, for messages.
        function_iris: IRI of each function by name.
        design_iris: IRI of each design by name.
        component_iris: IRI of each component by name.
        quality_iris: IRI of each quality attribute by name.
        objective_iris: IRI of each objective by name, those included that a grounding requires.
        grounding_iris: IRI of each grounding by the names of its objective and its design.
        qualities: how levels compare, of every quality attribute by name.
        designs: every design by name, with its expected levels.
        objectives: those that the ontologies hold already, but for those that a grounding requires.
        component_statuses: statuses that the ontologies assert.
        own_nodes: components that are nothing but nodes of designs.
        level_iris: IRI of the QAvalue of a required or expected level, by IRI of its owner, quality and level.
        reads: what rules and axioms of the models are about.
        environment_iris: IRI of each property of the surroundings by name.
        repairs: how components are repaired, by the component's name.
        bindings: which components fill the roles of designs.
        fills: the bindings of each role, and of each specification that defines one, by its IRI.
        asked: the properties that an analysis asks for.
        ontology: vocabulary, rules and models as N-Triples, without what comes as facts, and without what is idle.
        idle: what no analysis needs, as N-Triples: idle rules, and repairs of which no rule reads.
    """

    where: str
    function_iris: Mapping[str, str]
    design_iris: Mapping[str, str]
    component_iris: Mapping[str, str]
    quality_iris: Mapping[str, str]
    objective_iris: Mapping[str, str]
    grounding_iris: Mapping[tuple[str, str], str]
    qualities: Mapping[str, Quality]
    designs: Mapping[str, Design]
    objectives: tuple[Objective, ...]
    component_statuses: Mapping[str, str]
    own_nodes: frozenset[str]
    level_iris: Mapping[tuple[str, str, float], str]
    reads: Reads
    environment_iris: Mapping[str, str]
    repairs: Mapping[str, Repair]
    bindings: Bindings
    fills: Mapping[str, frozenset[str]]
    asked: tuple[str, ...]
    ontology: str
    idle: str


def read_model(
    triples: Sequence[Triple],
    where: str,
    directions: Mapping[str, Direction] | None = None,
    utility: str = "",
    reads: Reads | None = None,
    *,
    spares: bool = True,
) -> ApplicationModel:
    """Return what the triples of ontologies say.

    Args:
        triples: of the vocabulary, its rules and the application's models.
        where: the files, for messages.
        directions: of quality attributes by name; else as the models say (`qa_sign`, `qa_comparison_operator`). Where
            they do not, lower is better, and higher for the utility.
        utility: the quality attribute that is the utility of designs; empty for none.
        reads: what rules and axioms of the models are about.
        spares: whether designs with other bindings (`rebinds`) count.

    Raises:
        KnowledgeBaseError: an individual can't be used.
    """
    if not spares:
        left_out = {subject for subject, predicate, _ in triples if predicate == f"<{v.REBINDS}>"}
        triples = [triple for triple in triples if triple[0] not in left_out and triple[2] not in left_out]
    return _Reader(Graph(triples), where, directions or {}, utility, reads or Reads()).read()


class _Reader:
    def __init__(
        self, graph: Graph, where: str, directions: Mapping[str, Direction], utility: str, reads: Reads
    ) -> None:
        self._graph, self._where, self._directions, self._utility = graph, where, directions, utility
        self._reads = reads
        self._level_iris: dict[tuple[str, str, float], str] = {}
        self._functions = self._names((v.FUNCTION,), graph.objects(v.SOLVES_F) | graph.objects(v.TYPE_F))
        if not self._functions:
            raise KnowledgeBaseError(f"{where}: no individual of class Function: give the model that has them")
        self._designs = self._names((v.FUNCTION_DESIGN,), graph.subjects(v.SOLVES_F))
        self._components = self._names(
            (v.COMPONENT, v.COMPONENT_STATE, v.COMPONENT_SPECIFICATION),
            graph.subjects(v.REQUIRED_BY)
            | graph.subjects(v.C_STATUS)
            | graph.subjects(v.DEPLOYED_BY)
            | graph.objects(v.BINDING_COMPONENT),
        )
        types = self._names((v.QA_TYPE,), graph.objects(v.IS_QA_TYPE))
        # The others are ends of bands, which a saved knowledge base has.
        self._quality_types = {name: iri for name, iri in types.items() if not iri.startswith(_OWN)}
        self._objectives = self._names((v.OBJECTIVE,), graph.subjects(v.TYPE_F))
        self._environment = self._names((v.ENVIRONMENT_ATTRIBUTE,), graph.objects(v.CONSTRAINS))
        for name in sorted(self._environment.keys() & types.keys()):
            raise KnowledgeBaseError(f"{where}: {name} is both a quality and of the environment: rename one of them")
        self._function_name = _inverse(self._functions)
        self._component_name = _inverse(self._components)
        try:
            self._bindings = read_bindings(graph, self._designs, self._component_name)
            self._repairs = read_repairs(graph, self._component_name)
        except (BindingError, RepairError) as error:
            raise KnowledgeBaseError(f"{where}: {error}") from error
        self._quality_name = _inverse(types)
        self._guessed: list[str] = []  # directions of which nobody says anything
        self._qualities = {name: self._quality(name) for name in sorted(self._quality_types)}
        if self._guessed:
            _log.warning(
                "%s: no direction is given (qa_sign): %s; set ~qa_direction where that is wrong",
                where,
                ", ".join(self._guessed),
            )

    def read(self) -> ApplicationModel:
        graph = self._graph
        designs = self._with_rebound({name: self._design(name) for name in sorted(self._designs)})
        required = graph.objects(v.REQUIRES_O)
        asked_for = [name for name, iri in sorted(self._objectives.items()) if iri not in required]
        objectives = tuple(self._objective(name) for name in asked_for)
        self._check_requirements(designs)
        by_rule = (v.FD_REALISABILITY,) if v.FD_REALISABILITY in self._reads.properties else ()
        of_bindings = (v.B_STATUS,) if self._bindings.roles else ()
        asked = (*v.CONCLUSIONS, *by_rule, *of_bindings)
        repairs = dict.fromkeys(about_repairs(graph) if self._reads.properties.isdisjoint(_OF_REPAIRS) else ())
        static = [triple for triple in self._static(designs) if triple not in repairs]
        ontology, idle = without_idle(static, v.FACTS, asked)
        return ApplicationModel(
            where=self._where,
            function_iris=self._functions,
            design_iris=self._designs,
            component_iris=self._components,
            quality_iris=self._quality_types,
            objective_iris=self._objectives,
            grounding_iris=self._groundings(),
            qualities=self._qualities,
            designs=designs,
            objectives=objectives,
            component_statuses={
                self._component_name[subject]: str(value)
                for subject, value in graph.literals(v.C_STATUS)
                if value in v.COMPONENT_STATUSES
            },
            own_nodes=self._own_nodes(),
            level_iris=self._level_iris,
            reads=self._reads,
            environment_iris=self._environment,
            repairs=self._repairs,
            bindings=self._bindings,
            fills=self._fills(),
            asked=asked,
            ontology=write_ntriples(ontology),
            idle=write_ntriples([*idle, *repairs]),
        )

    def _fills(self) -> dict[str, frozenset[str]]:
        """Return the bindings of each role, and of each specification that defines one."""
        found = {role: frozenset(self._bindings.filling(role)) for role in self._bindings.roles.values()}
        for role, specification in self._graph.pairs(v.ROLE_DEF):
            if role in found:
                found[specification] = found.get(specification, frozenset()) | found[role]
        return found

    def _groundings(self) -> dict[tuple[str, str], str]:
        objective_name, design_name = _inverse(self._objectives), _inverse(self._designs)
        return {
            (objective_name[objective], design_name[design]): iri
            for iri, objective in self._graph.pairs(v.SOLVES_O)
            for design in self._graph.objects_of(iri, v.TYPE_FD)
            if objective in objective_name and design in design_name
        }

    def _names(self, classes: Iterable[str], also: Iterable[str]) -> dict[str, str]:
        """Return local name -> IRI of the individuals that classes or properties show to belong to a kind."""
        iris = {iri for name in classes for iri in self._graph.instances(name)} | set(also)
        result: dict[str, str] = {}
        for iri in sorted(iris):
            name = local_name(iri)
            if result.setdefault(name, iri) != iri:
                raise KnowledgeBaseError(
                    f"{self._where}: two individuals are called {name}: {result[name]} and {iri}: rename one of them"
                )
        return result

    def _quality(self, name: str) -> Quality:
        """Return how levels of a quality compare: by the given direction, else by the model, else by a guess."""
        iri = self._quality_types[name]
        low, high = (self._bound(iri, predicate) for predicate in (v.QA_MIN, v.QA_MAX))
        operators = set(self._graph.literals_of(iri, v.QA_COMPARISON_OPERATOR))
        signs = {_number(text) for text in self._graph.literals_of(iri, v.QA_SIGN)}
        if signs - {1.0, -1.0} or len(signs) > 1:
            raise KnowledgeBaseError(f"{self._where}: qa_sign of {name} must be one value, 1 or -1")
        compared = bool(operators)
        try:
            quality = Quality.compared_by(operators.pop() if operators else ">", low, high)
        except ValueError as error:
            raise KnowledgeBaseError(f"{self._where}: qa_comparison_operator of {name}: {error}") from error
        if operators:
            raise KnowledgeBaseError(f"{self._where}: {name} has several qa_comparison_operator: give it one")
        reaching = quality.reaching_violates or "true" in self._graph.literals_of(iri, v.QA_REACHING_VIOLATES)
        direction = self._directions.get(name)
        if direction is None and signs:
            direction = Direction.HIGHER_IS_BETTER if signs == {-1.0} else Direction.LOWER_IS_BETTER
        elif direction is None:
            direction = quality.direction if compared else self._guess(name)
        typical = self._typical(name, iri)
        return replace(quality, direction=direction, reaching_violates=reaching, typical=typical)

    def _guess(self, name: str) -> Direction:
        """Return the direction of a quality of which nothing says it."""
        if name == self._utility:
            self._guessed.append(f"{name}: higher is better, as it is the utility")
            return Direction.HIGHER_IS_BETTER
        self._guessed.append(f"{name}: lower is better")
        return Direction.LOWER_IS_BETTER

    def _typical(self, name: str, iri: str) -> str:
        """Return the quality whose expected level is the usual one of a quality; empty: there is none."""
        for other in self._graph.literals_of(iri, v.QA_TYPICAL)[:1]:
            if other not in self._quality_types:
                raise KnowledgeBaseError(f"{self._where}: qa_typical of {name} is {other!r}: no QualityAttributeType")
            return other
        return ""

    def _bound(self, quality: str, predicate: str) -> float | None:
        numbers = [_number(text) for text in self._graph.literals_of(quality, predicate)]
        if len(numbers) > 1 or not all(math.isfinite(number) for number in numbers):
            name = local_name(quality)
            raise KnowledgeBaseError(f"{self._where}: {local_name(predicate)} of {name} must be one finite number")
        return numbers[0] if numbers else None

    def _design(self, name: str) -> Design:
        iri = self._designs[name]
        functions = sorted(self._graph.objects_of(iri, v.SOLVES_F))
        if len(functions) != 1:
            say = "no Function" if not functions else "several Functions"
            raise KnowledgeBaseError(f"{self._where}: FunctionDesign {name} solves {say}: give it one solvesF")
        expected = self._read_levels(iri, v.HAS_QA_ESTIMATION)
        if not expected:
            _log.warning("FunctionDesign %s has no expected quality levels (hasQAestimation)", name)
        bindings = self._bindings.filled(name)
        required = (self._component_name[component] for component in self._graph.subjects_of(v.REQUIRED_BY, iri))
        return Design(
            name=name,
            function=self._function_name[functions[0]],
            expected=expected,
            components=frozenset([*required, *bindings.values()]),
            requires=tuple(sorted(local_name(f) for f in self._graph.objects_of(iri, v.REQUIRES_F))),
            nodes=frozenset(self._component_name[c] for c in self._graph.subjects_of(v.DEPLOYED_BY, iri)),
            groups=self._groups(iri),
            needs=tuple(self._need(k, name) for k in sorted(self._graph.objects_of(iri, v.REQUIRES_ENVIRONMENT))),
            bindings=bindings,
        )

    def _with_rebound(self, designs: dict[str, Design]) -> dict[str, Design]:
        """Return the designs, each with the name of the one that it is with other bindings."""
        functions = {name: design.function for name, design in designs.items()}
        try:
            found = rebound(self._graph, self._designs, functions)
        except BindingError as error:
            raise KnowledgeBaseError(f"{self._where}: {error}") from error
        return designs | {name: replace(designs[name], rebinds=other) for name, other in found.items()}

    def _need(self, constraint: str, design: str) -> Need:
        """Return what a design needs of the surroundings."""
        attributes = self._graph.objects_of(constraint, v.CONSTRAINS)
        limits = {name: self._bound(constraint, name) for name in (v.ENV_LEAST, v.ENV_MOST)}
        least, most = limits[v.ENV_LEAST], limits[v.ENV_MOST]
        if len(attributes) != 1 or (least is None and most is None):
            raise KnowledgeBaseError(
                f"{self._where}: {local_name(constraint)}, which {design} requires, must have one constrains, and "
                "env_least or env_most"
            )
        attribute = local_name(attributes.pop())
        return Need(attribute, -math.inf if least is None else least, math.inf if most is None else most)

    def _groups(self, design: str) -> dict[str, str]:
        """Return by quality the group in which the levels that are expected of a design are corrected."""
        found = {}
        for value in sorted(self._graph.objects_of(design, v.HAS_QA_ESTIMATION)):
            types = self._graph.objects_of(value, v.IS_QA_TYPE)
            for text in self._graph.literals_of(value, v.QA_CORRECTION_GROUP)[:1]:
                found.update({self._quality_name[quality]: text for quality in types})
        return found

    def _objective(self, name: str) -> Objective:
        iri = self._objectives[name]
        functions = self._graph.objects_of(iri, v.TYPE_F)
        if len(functions) != 1:
            raise KnowledgeBaseError(f"{self._where}: Objective {name} must have one Function: give it one typeF")
        limits = self._read_levels(iri, v.HAS_NFR)
        improves, waits = (
            {text in ("true", "1") for text in self._graph.literals_of(iri, predicate)}
            for predicate in (v.O_ALWAYS_IMPROVE, v.O_WHEN_REQUIRED)
        )
        function, improve = self._function_name[functions.pop()], improves.pop() if improves else None
        return Objective(name, function, limits, improve, when_required=True in waits)

    def _read_levels(self, owner: str, predicate: str) -> dict[str, float]:
        levels: dict[str, float] = {}
        for value in sorted(self._graph.objects_of(owner, predicate)):
            types = self._graph.objects_of(value, v.IS_QA_TYPE)
            numbers = [_number(literal) for literal in self._graph.literals_of(value, v.HAS_VALUE)]
            if len(types) != 1 or len(numbers) != 1 or not math.isfinite(numbers[0]):
                _log.warning(
                    "QAvalue %s of %s is left out: it needs one isQAtype and one finite hasValue",
                    local_name(value),
                    local_name(owner),
                )
                continue
            quality = self._quality_name[types.pop()]
            kind = self._qualities.get(quality) or self._qualities[quality.removesuffix(LEAST).removesuffix(MOST)]
            quality = self._end(value, quality, kind)
            if not kind.holds(numbers[0]):
                _log.warning(
                    "QAvalue %s of %s is left out: %g is not within the range of %s, %s",
                    local_name(value),
                    local_name(owner),
                    numbers[0],
                    quality,
                    kind.range,
                )
                continue
            if quality in levels:
                _log.warning(
                    "%s has two levels of %s: %s is left out; the limits of a band differ in nfr_comparison_operator",
                    local_name(owner),
                    quality,
                    local_name(value),
                )
                continue
            levels[quality] = numbers[0]
            self._level_iris[owner, quality, numbers[0]] = value
        return levels

    def _end(self, value: str, quality: str, kind: Quality) -> str:
        """Return how the limit is called that a QAvalue is: on the other side of a band, it has a name of its own."""
        for operator in self._graph.literals_of(value, v.NFR_COMPARISON_OPERATOR)[:1]:
            try:
                direction = Quality.compared_by(operator).direction
            except ValueError as error:
                name = local_name(value)
                raise KnowledgeBaseError(f"{self._where}: nfr_comparison_operator of {name}: {error}") from error
            return quality if direction is kind.direction else kind.other_end(quality)
        return quality

    def _check_requirements(self, designs: Mapping[str, Design]) -> None:
        """Refuse requirements that nothing can fulfil, and warn of functions that no design solves."""
        solving: dict[str, list[Design]] = {function: [] for function in sorted(self._functions)}
        for design in designs.values():
            solving[design.function].append(design)
        for function, solvers in solving.items():
            if not solvers:
                _log.warning("Function %s can't be fulfilled: no FunctionDesign solves it", function)
        levels: dict[str, int] = {}  # of functions that are visited: itself, and those below it

        def visit(function: str, path: tuple[tuple[str, str], ...]) -> int:
            start = next((i for i, (above, _) in enumerate(path) if above == function), None)
            if start is not None:
                cycle = "".join(f"{above} -> ({design}) " for above, design in path[start:])
                raise KnowledgeBaseError(
                    f"{self._where}: functions require each other ({cycle}-> {function}): break the cycle"
                )
            if len(path) + levels.get(function, 1) > _DEEPEST:
                chain = " -> ".join([*(above for above, _ in path), function][:_SHOWN])
                raise KnowledgeBaseError(
                    f"{self._where}: functions require each other over more than {_DEEPEST} levels ({chain} ...): "
                    "have designs require fewer functions"
                )
            if function in levels:
                return levels[function]
            below = 0
            for design in solving[function]:
                for needed in design.requires:
                    if needed not in solving:
                        raise KnowledgeBaseError(
                            f"{self._where}: {design.name} requires {needed}, which is no Function"
                        )
                    below = max(below, visit(needed, (*path, (function, design.name))))
            levels[function] = 1 + below
            return 1 + below

        for function in sorted(self._functions):
            visit(function, ())

    def _own_nodes(self) -> frozenset[str]:
        """Return the components of which the ontologies say only which designs bring them: no rule is about them."""
        nodes = self._graph.subjects(v.DEPLOYED_BY)
        others = [t for t in self._graph.triples if iri_of(t[1]) not in _OF_NODES]
        nodes -= {iri_of(term) for subject, _, value in others for term in (subject, value)}
        return frozenset(self._component_name[iri] for iri in nodes)

    def _static(self, designs: Mapping[str, Design]) -> list[Triple]:
        """Return the ontology without what comes as facts, and without what no rule reads."""
        reads = self._reads.properties
        values = {value for name in (v.HAS_NFR, v.HAS_QA_VALUE) for value in self._graph.objects(name)}
        dropped = {*_MOMENTARY, *_ORDER, *_COMPARISONS, v.DEPLOYED_BY} - (reads - {*_MOMENTARY, *_ORDER, v.QA_SIGN})
        dropped |= {v.HAS_NFR, v.HAS_QA_VALUE}
        if reads.isdisjoint(_LEVELS):
            values |= self._graph.instances(v.QA_VALUE) | self._graph.objects(v.HAS_QA_ESTIMATION)
            dropped |= set(_LEVELS)
        else:
            values -= set(self._level_iris.values())

        # Where rules find failures, a component has what they find beside what is observed of it.
        lifted = (f"<{v.C_STATUS}>", f"<{v.OWL_FUNCTIONAL_PROPERTY}>") if self._reads.failures else ()

        def stays(triple: Triple) -> bool:
            is_lifted = (triple[0], triple[2]) == lifted
            return not is_lifted and iri_of(triple[1]) not in dropped and iri_of(triple[0]) not in values

        triples = [_with_decimal(triple) for triple in self._graph.triples if stays(triple)]
        for name, quality in self._qualities.items():
            iri = self._quality_types[name]
            triples.append(assertion_triple(Assertion(iri, v.RDF_TYPE, v.QA_TYPE)))
            triples.append(assertion_triple(Assertion(iri, v.QA_SIGN, str(quality.direction.sign), _DECIMAL)))
            if quality.reaching_violates:
                triples.append(assertion_triple(Assertion(iri, v.QA_REACHING_VIOLATES, "true", v.XSD + "boolean")))
        triples += map(assertion_triple, self._order(designs))
        try:
            triples += map(assertion_triple, order(self._graph, self._bindings))
        except BindingError as error:
            raise KnowledgeBaseError(f"{self._where}: {error}") from error
        return list(dict.fromkeys(triples))

    def _order(self, designs: Mapping[str, Design]) -> Iterator[Assertion]:
        """Yield an order of all designs of each function that a design requires, for the rules F1 to F4."""
        for function in sorted({name for design in designs.values() for name in design.requires}):
            iri = self._functions[function]
            found = [self._designs[name] for name, design in designs.items() if design.function == function]
            if not found:
                yield Assertion(iri, v.F_FULFILLABLE, "false", v.XSD + "boolean")
                continue
            yield Assertion(iri, v.F_FIRST_DESIGN, found[0])
            yield Assertion(iri, v.F_LAST_DESIGN, found[-1])
            for design, following in itertools.pairwise(found):
                yield Assertion(design, v.FD_NEXT, following)


def _with_decimal(triple: Triple) -> Triple:
    """Return a triple with a level as xsd:decimal, by which all levels can be compared."""
    number = _number((literal_of(triple[2]) or ("",))[0]) if iri_of(triple[1]) == v.HAS_VALUE else math.nan
    return (*triple[:2], f'"{decimal_text(number)}"^^<{_DECIMAL}>') if math.isfinite(number) else triple


def _inverse(names: Mapping[str, str]) -> dict[str, str]:
    return {iri: name for name, iri in names.items()}


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
