"""The TOMASys knowledge base: OWL files in, facts and statuses by name, assertions for a reasoner."""

from __future__ import annotations

import io
import logging
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import owlready2

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Analysis, Design, Direction, Facts, Objective, ObjectiveAnalysis, Quality
from mros1_reasoner.knowledge.ontology_files import read_ontologies
from mros1_reasoner.knowledge.reasoner import Assertion, Reasoner
from mros1_reasoner.knowledge.triples import (
    Graph,
    Triple,
    TripleError,
    assertion_triple,
    iri_of,
    literal_of,
    local_name,
    write_ntriples,
)

_log = logging.getLogger(__name__)

_OWL_FOLDER = Path(__file__).resolve().parents[3] / "owl"
_DECIMAL = v.XSD + "decimal"
_STRING = v.XSD + "string"
# Statements that hold at one moment only. They come as facts of each analysis, so the ontology goes without them.
_MOMENTARY = (*v.DERIVED_STATUSES, v.O_UPDATABLE, v.C_STATUS, v.FD_ERROR_LOG, v.SOLVES_O, v.TYPE_FD, v.REQUIRES_O)
_COMPARISONS = (v.QA_SIGN, v.QA_COMPARISON_OPERATOR, v.QA_REACHING_VIOLATES)
_LEVELS = (v.HAS_NFR, v.HAS_QA_VALUE, v.HAS_QA_ESTIMATION, v.HAS_VALUE, v.IS_QA_TYPE)


class KnowledgeBaseError(Exception):
    """The models can't be used; one line that says which file or individual, why, and what to do."""


def own_ontologies() -> tuple[Path, Path]:
    """Return the paths of owl/tomasys.owl and owl/mros.owl.

    Raises:
        KnowledgeBaseError: they are not beside this package.
    """
    folder = _OWL_FOLDER
    if not folder.is_dir():
        import rospkg

        try:
            folder = Path(rospkg.RosPack().get_path("mros1_reasoner")) / "owl"
        except rospkg.ResourceNotFound as error:
            raise KnowledgeBaseError("owl/tomasys.owl is not found: source the workspace") from error
    return folder / "tomasys.owl", folder / "mros.owl"


class KnowledgeBase:
    """What the models say. It does not change once it is loaded; what changes are the facts given to `analyse`.

    Attributes:
        functions: names of all functions.
        designs: every design by name, with its expected levels.
        components: names of all components.
        qualities: how levels compare, of every quality attribute by name.
        objectives: those that the models hold already, but for those that a grounding requires.
        component_statuses: statuses that the models assert.
        files: all that was loaded, imports included, but for the package's own vocabulary.
        ontology: vocabulary, rules and models as N-Triples, without what comes as facts.
    """

    def __init__(
        self,
        models: Sequence[Path],
        vocabularies: Sequence[Path] = (),
        directions: Mapping[str, Direction] | None = None,
    ) -> None:
        """Load the models beside the vocabulary.

        Args:
            models: OWL files of the application.
            vocabularies: further OWL files to load before them; the package's own are always loaded.
            directions: of quality attributes by name; else as the models say (`qa_sign`), else lower is better.

        Raises:
            KnowledgeBaseError: a file or an individual can't be used.
        """
        if not models:
            raise KnowledgeBaseError("no application model is given: set model_file to an OWL file")
        own = own_ontologies()
        others = [path for path in vocabularies if path.resolve() not in {file.resolve() for file in own}]
        try:
            triples, self.files = read_ontologies(own, [*others, *models])
        except TripleError as error:
            raise KnowledgeBaseError(str(error)) from error
        graph = Graph(triples)
        self._where = ", ".join(str(path) for path in models)
        self._functions = self._names(graph, (v.FUNCTION,), graph.objects(v.SOLVES_F) | graph.objects(v.TYPE_F))
        if not self._functions:
            raise KnowledgeBaseError(f"{self._where}: no individual of class Function: give the model that has them")
        self._designs = self._names(graph, (v.FUNCTION_DESIGN,), graph.subjects(v.SOLVES_F))
        self._components = self._names(
            graph,
            (v.COMPONENT, v.COMPONENT_STATE, v.COMPONENT_SPECIFICATION),
            graph.subjects(v.REQUIRED_BY) | graph.subjects(v.C_STATUS),
        )
        self._quality_types = self._names(graph, (v.QA_TYPE,), graph.objects(v.IS_QA_TYPE))
        self._objectives = self._names(graph, (v.OBJECTIVE,), graph.subjects(v.TYPE_F))
        self._function_name = {iri: name for name, iri in self._functions.items()}
        self._design_name = {iri: name for name, iri in self._designs.items()}
        self._component_name = {iri: name for name, iri in self._components.items()}
        self._quality_name = {iri: name for name, iri in self._quality_types.items()}

        self.functions = tuple(sorted(self._functions))
        self.components = frozenset(self._components)
        self.qualities = {name: self._quality(graph, name, directions or {}) for name in sorted(self._quality_types)}
        self.designs = {name: self._design(graph, name) for name in sorted(self._designs)}
        required = graph.objects(v.REQUIRES_O)
        asked_for = [name for name, iri in sorted(self._objectives.items()) if iri not in required]
        self.objectives = tuple(self._objective(graph, name) for name in asked_for)
        self.component_statuses = {
            self._component_name[subject]: str(value)
            for subject, value in graph.literals(v.C_STATUS)
            if value in v.COMPONENT_STATUSES
        }
        self._check_requirements()
        objective_name = {iri: name for name, iri in self._objectives.items()}
        self._model_groundings = {
            (objective_name[objective], self._design_name[design]): iri
            for iri, objective in graph.pairs(v.SOLVES_O)
            for design in graph.objects_of(iri, v.TYPE_FD)
            if objective in objective_name and design in self._design_name
        }
        self.ontology = self._static(graph)

    def solving(self, function: str) -> tuple[Design, ...]:
        """Return the designs that solve a function, by name."""
        return tuple(design for design in self.designs.values() if design.function == function)

    def grounding(self, objective: str, design: str) -> str:
        """Return the name of the grounding of an objective by a design."""
        iri = self._model_groundings.get((objective, design))
        return local_name(iri) if iri else f"fg_{objective}_{design}"

    def assertions(self, facts: Facts) -> list[Assertion]:
        """Return the facts as assertions for a reasoner.

        Raises:
            KnowledgeBaseError: a fact names something that the models do not hold.
        """
        result: list[Assertion] = []
        for objective in facts.objectives:
            iri = self._objective_iri(objective.name)
            result.append(Assertion(iri, v.RDF_TYPE, v.OBJECTIVE))
            result.append(Assertion(iri, v.TYPE_F, self._find(self._functions, objective.function, "Function")))
            for quality, limit in sorted(objective.limits.items()):
                value = _nfr_iri(objective.name, quality)
                result += [Assertion(iri, v.HAS_NFR, value), *self._level(value, quality, limit)]
            design = facts.groundings.get(objective.name)
            if design is None:
                continue
            grounding = self._grounding_iri(objective.name, design)
            result.append(Assertion(grounding, v.RDF_TYPE, v.FUNCTION_GROUNDING))
            result.append(Assertion(grounding, v.SOLVES_O, iri))
            result.append(Assertion(grounding, v.TYPE_FD, self._find(self._designs, design, "FunctionDesign")))
            for required in facts.requires.get(objective.name, ()):
                result.append(Assertion(grounding, v.REQUIRES_O, self._objective_iri(required)))
            if objective.name in facts.failed:
                result.append(Assertion(iri, v.O_CAUSE, v.IN_ERROR_NFR, _STRING))
            if objective.name in facts.broken:
                result.append(Assertion(grounding, v.FG_CAUSE, v.IN_ERROR_COMPONENT, _STRING))
            for (owner, quality), level in sorted(facts.levels.items()):
                if owner == objective.name:
                    value = f"{grounding}_{quality}"
                    result += [Assertion(grounding, v.HAS_QA_VALUE, value), *self._level(value, quality, level)]
        for component, status in sorted(facts.components.items()):
            iri = self._find(self._components, component, "Component")
            result.append(Assertion(iri, v.C_STATUS, status, _STRING))
        return result

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
        for assertion in reasoner.infer(self.assertions(facts), v.CONCLUSIONS):
            found[assertion.property][assertion.subject].add(assertion.value)
        names = {self._objective_iri(objective.name): objective.name for objective in facts.objectives}
        objectives = {}
        for objective in facts.objectives:
            iri = self._objective_iri(objective.name)
            causes = frozenset(found[v.O_CAUSE][iri])
            violated_values = found[v.O_VIOLATED_NFR][iri]
            design = facts.groundings.get(objective.name)
            grounding_causes = found[v.FG_CAUSE][self._grounding_iri(objective.name, design)] if design else set()
            objectives[objective.name] = ObjectiveAnalysis(
                status=_worst(causes) or (v.IN_PROGRESS if design else v.UNGROUNDED),
                causes=causes,
                violated=tuple(q for q in sorted(objective.limits) if _nfr_iri(objective.name, q) in violated_values),
                grounding_status=_worst(grounding_causes),
            )
        return Analysis(
            objectives=objectives,
            unrealisable={
                self._design_name[design]: tuple(sorted(self._component_name.get(c, local_name(c)) for c in components))
                for design, components in found[v.FD_UNREALISABLE_BY].items()
                if design in self._design_name
            },
            tried=frozenset(
                (self._design_name[design], names[objective])
                for design, tried_for in found[v.FD_ERROR_LOG].items()
                for objective in tried_for
                if design in self._design_name and objective in names
            ),
        )

    def world(self, facts: Facts | None = None, analysis: Analysis | None = None) -> owlready2.World:
        """Return an owlready2 World of its own with the ontology, the facts, and the statuses of an analysis."""
        triples = [assertion_triple(assertion) for assertion in self.assertions(facts or Facts())]
        if facts and analysis:
            triples += [assertion_triple(assertion) for assertion in self._statuses(facts, analysis)]
        for design in self.designs.values():
            for quality, level in sorted(design.expected.items()):
                iri = f"{v.RUNTIME}expected_{design.name}_{quality}"
                triples.append(assertion_triple(Assertion(self._designs[design.name], v.HAS_QA_ESTIMATION, iri)))
                triples += [assertion_triple(assertion) for assertion in self._level(iri, quality, level)]
        world = owlready2.World()
        text = self.ontology + write_ntriples(triples)
        world.get_ontology(v.RUNTIME).load(fileobj=io.BytesIO(text.encode()), format="ntriples")
        return world

    def save(self, path: Path, facts: Facts | None = None, analysis: Analysis | None = None) -> None:
        """Write everything as one OWL file (RDF/XML) that loads again as a model.

        Raises:
            KnowledgeBaseError: the file can't be written.
        """
        world = self.world(facts, analysis)
        try:
            world.get_ontology(v.RUNTIME).save(str(path), format="rdfxml")
        except OSError as error:
            raise KnowledgeBaseError(f"{path}: {error.strerror or error}: give another file") from error
        finally:
            world.close()

    # Reading the models

    def _names(self, graph: Graph, classes: Iterable[str], also: Iterable[str]) -> dict[str, str]:
        """Return local name -> IRI of the individuals of the classes and of those that properties show to be one."""
        iris = {iri for name in classes for iri in graph.instances(name)} | set(also)
        result: dict[str, str] = {}
        for iri in sorted(iris):
            name = local_name(iri)
            if result.setdefault(name, iri) != iri:
                raise KnowledgeBaseError(
                    f"{self._where}: two individuals are called {name}: {result[name]} and {iri}: rename one of them"
                )
        return result

    def _quality(self, graph: Graph, name: str, directions: Mapping[str, Direction]) -> Quality:
        """Return how levels of a quality compare: as given, else as the model says, else lower is better."""
        iri = self._quality_types[name]
        low, high = (self._bound(graph, iri, predicate) for predicate in (v.QA_MIN, v.QA_MAX))
        operators = set(graph.literals_of(iri, v.QA_COMPARISON_OPERATOR))
        signs = {_number(text) for text in graph.literals_of(iri, v.QA_SIGN)}
        if signs - {1.0, -1.0} or len(signs) > 1:
            raise KnowledgeBaseError(f"{self._where}: qa_sign of {name} must be one value, 1 or -1")
        try:
            quality = Quality.compared_by(operators.pop() if operators else ">", low, high)
        except ValueError as error:
            raise KnowledgeBaseError(f"{self._where}: qa_comparison_operator of {name}: {error}") from error
        if operators:
            raise KnowledgeBaseError(f"{self._where}: {name} has several qa_comparison_operator: give it one")
        direction = Direction.HIGHER_IS_BETTER if signs == {-1.0} else Direction.LOWER_IS_BETTER
        reaching = quality.reaching_violates or "true" in graph.literals_of(iri, v.QA_REACHING_VIOLATES)
        direction = directions.get(name, direction if signs else quality.direction)
        return replace(quality, direction=direction, reaching_violates=reaching)

    def _bound(self, graph: Graph, quality: str, predicate: str) -> float | None:
        numbers = [_number(text) for text in graph.literals_of(quality, predicate)]
        if len(numbers) > 1 or not all(math.isfinite(number) for number in numbers):
            name = local_name(quality)
            raise KnowledgeBaseError(f"{self._where}: {local_name(predicate)} of {name} must be one finite number")
        return numbers[0] if numbers else None

    def _design(self, graph: Graph, name: str) -> Design:
        iri = self._designs[name]
        functions = sorted(graph.objects_of(iri, v.SOLVES_F))
        if len(functions) != 1:
            say = "no Function" if not functions else "several Functions"
            raise KnowledgeBaseError(f"{self._where}: FunctionDesign {name} solves {say}: give it one solvesF")
        expected = self._read_levels(graph, iri, v.HAS_QA_ESTIMATION)
        if not expected:
            _log.warning("FunctionDesign %s has no expected quality levels (hasQAestimation)", name)
        return Design(
            name=name,
            function=self._function_name[functions[0]],
            expected=expected,
            components=frozenset(self._component_name[c] for c in graph.subjects_of(v.REQUIRED_BY, iri)),
            requires=tuple(sorted(local_name(f) for f in graph.objects_of(iri, v.REQUIRES_F))),
        )

    def _objective(self, graph: Graph, name: str) -> Objective:
        iri = self._objectives[name]
        functions = graph.objects_of(iri, v.TYPE_F)
        if len(functions) != 1:
            raise KnowledgeBaseError(f"{self._where}: Objective {name} must have one Function: give it one typeF")
        limits = self._read_levels(graph, iri, v.HAS_NFR)
        improves = {text in ("true", "1") for text in graph.literals_of(iri, v.O_ALWAYS_IMPROVE)}
        return Objective(name, self._function_name[functions.pop()], limits, improves.pop() if improves else None)

    def _read_levels(self, graph: Graph, owner: str, predicate: str) -> dict[str, float]:
        levels: dict[str, float] = {}
        for value in sorted(graph.objects_of(owner, predicate)):
            types = graph.objects_of(value, v.IS_QA_TYPE)
            numbers = [_number(literal) for literal in graph.literals_of(value, v.HAS_VALUE)]
            if len(types) != 1 or len(numbers) != 1 or not math.isfinite(numbers[0]):
                _log.warning(
                    "QAvalue %s of %s is left out: it needs one isQAtype and one finite hasValue",
                    local_name(value),
                    local_name(owner),
                )
                continue
            quality = self._quality_name[types.pop()]
            kind = self.qualities[quality]
            if not kind.holds(numbers[0]):
                _log.warning(
                    "QAvalue %s of %s is left out: %g is not within the range of %s, %s to %s",
                    local_name(value),
                    local_name(owner),
                    numbers[0],
                    quality,
                    "any" if kind.low is None else f"{kind.low:g}",
                    "any" if kind.high is None else f"{kind.high:g}",
                )
                continue
            if quality in levels:
                _log.warning("%s has two levels of %s: %s is left out", local_name(owner), quality, local_name(value))
                continue
            levels[quality] = numbers[0]
        return levels

    def _check_requirements(self) -> None:
        """Refuse requirements that nothing can fulfil; tell of functions that no design solves."""
        solving: dict[str, list[Design]] = {function: [] for function in self.functions}
        for design in self.designs.values():
            solving[design.function].append(design)
        for function, designs in solving.items():
            if not designs:
                _log.warning("Function %s can't be fulfilled: no FunctionDesign solves it", function)
        finished: set[str] = set()

        def visit(function: str, path: tuple[tuple[str, str], ...]) -> None:
            start = next((i for i, (above, _) in enumerate(path) if above == function), None)
            if start is not None:
                cycle = "".join(f"{above} -> ({design}) " for above, design in path[start:])
                raise KnowledgeBaseError(
                    f"{self._where}: functions require each other ({cycle}-> {function}): break the cycle"
                )
            if function in finished:
                return
            for design in solving[function]:
                for needed in design.requires:
                    if needed not in solving:
                        raise KnowledgeBaseError(
                            f"{self._where}: {design.name} requires {needed}, which is no Function"
                        )
                    visit(needed, (*path, (function, design.name)))
            finished.add(function)

        for function in self.functions:
            visit(function, ())

    def _static(self, graph: Graph) -> str:
        values = graph.instances(v.QA_VALUE) | {
            value
            for predicate in (v.HAS_NFR, v.HAS_QA_VALUE, v.HAS_QA_ESTIMATION)
            for value in graph.objects(predicate)
        }
        dropped = {*_MOMENTARY, *_LEVELS, *_COMPARISONS}

        def stays(triple: Triple) -> bool:
            subject, predicate, value = triple
            name = iri_of(predicate)
            if name in (v.B_STATUS, v.CC_AVAILABILITY):
                return literal_of(value) not in (("true", v.XSD + "boolean"), ("1", v.XSD + "boolean"))
            return name not in dropped and iri_of(subject) not in values

        triples = [triple for triple in graph.triples if stays(triple)]
        for name, quality in self.qualities.items():
            iri = self._quality_types[name]
            triples.append(assertion_triple(Assertion(iri, v.RDF_TYPE, v.QA_TYPE)))
            triples.append(assertion_triple(Assertion(iri, v.QA_SIGN, str(quality.direction.sign), _DECIMAL)))
            if quality.reaching_violates:
                triples.append(assertion_triple(Assertion(iri, v.QA_REACHING_VIOLATES, "true", v.XSD + "boolean")))
        return write_ntriples(triples)

    # Names and IRIs

    def _find(self, iris: Mapping[str, str], name: str, kind: str) -> str:
        if name not in iris:
            raise KnowledgeBaseError(f"{self._where}: no {kind} is called {name!r}")
        return iris[name]

    def _objective_iri(self, name: str) -> str:
        return self._objectives.get(name) or f"{v.RUNTIME}{name}"

    def _grounding_iri(self, objective: str, design: str) -> str:
        return self._model_groundings.get((objective, design)) or f"{v.RUNTIME}fg_{objective}_{design}"

    def _level(self, iri: str, quality: str, level: float) -> list[Assertion]:
        if not math.isfinite(level):
            raise KnowledgeBaseError(f"level of {quality} is {level}: it must be a finite number")
        return [
            Assertion(iri, v.RDF_TYPE, v.QA_VALUE),
            Assertion(iri, v.IS_QA_TYPE, self._find(self._quality_types, quality, "QualityAttributeType")),
            Assertion(iri, v.HAS_VALUE, f"{level:.12f}".rstrip("0").rstrip("."), _DECIMAL),
        ]

    def _statuses(self, facts: Facts, analysis: Analysis) -> Iterable[Assertion]:
        for name, objective in analysis.objectives.items():
            yield Assertion(self._objective_iri(name), v.O_STATUS, objective.status, _STRING)
            updatable = "true" if v.UPDATABLE in objective.causes else "false"
            yield Assertion(self._objective_iri(name), v.O_UPDATABLE, updatable, v.XSD + "boolean")
            if objective.grounding_status:
                grounding = self._grounding_iri(name, facts.groundings[name])
                yield Assertion(grounding, v.FG_STATUS, objective.grounding_status, _STRING)
        for name, iri in self._designs.items():
            realisable = "false" if name in analysis.unrealisable else "true"
            yield Assertion(iri, v.FD_REALISABILITY, realisable, v.XSD + "boolean")


def _worst(causes: Iterable[str]) -> str:
    found = set(causes)
    return next((cause for cause in (v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR, v.UPDATABLE) if cause in found), "")


def _nfr_iri(objective: str, quality: str) -> str:
    return f"{v.RUNTIME}nfr_{objective}_{quality}"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
