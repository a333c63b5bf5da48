"""What models bring along beside their individuals: rules and axioms, so that they count beside the generic rules.

A rule of a model stays as it is, but for

- copies of the generic rules, under whatever labels: they say nothing new;
- a rule that compares the observed level of a quality with the required one: the generic rule QA does that, and the
  comparison tells which levels of the quality are the better ones;
- names of former vocabularies: INTERNAL_ERROR and EXTERNAL_ERROR, and `c_status` as a boolean.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.rules import Atom, Rule, rule_nodes, rules_of
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, literal_of, local_name, term_of

_log = logging.getLogger(__name__)

_A_RULE = f"<{v.SWRL}Imp>"
_PREDICATE, _ARGUMENT = f"<{v.SWRL}propertyPredicate>", f"<{v.SWRL}argument2>"
_STATUS_NAMES = {v.O_STATUS: v.O_CAUSE, v.FG_STATUS: v.FG_CAUSE, v.O_CAUSE: v.O_CAUSE, v.FG_CAUSE: v.FG_CAUSE}
_ERRORS = (v.IN_ERROR_NFR, v.IN_ERROR_COMPONENT)
_FORMER_ERRORS = ("INTERNAL_ERROR", "EXTERNAL_ERROR")
_STATUSES = (*_ERRORS, v.UPDATABLE, v.UNGROUNDED, v.IN_PROGRESS, v.UNREACHABLE)
_FORMER_COMPONENT_STATUSES = {"true": v.WORKS, "false": v.FAILED}
_COMPARISONS = {
    v.SWRLB + name: (operator, mirrored)
    for name, operator, mirrored in (
        ("greaterThan", ">", "<"),
        ("greaterThanOrEqual", ">=", "<="),
        ("lessThan", "<", ">"),
        ("lessThanOrEqual", "<=", ">="),
    )
}
_RELATING = (v.RDFS_SUB_PROPERTY_OF, v.OWL_EQUIVALENT_PROPERTY, v.OWL_INVERSE_OF)
_DECLARING = (v.RDF_TYPE, v.RDFS_DOMAIN, v.RDFS_RANGE)

_Shape = list[tuple[str, tuple[str, ...]]]


@dataclass(frozen=True)
class Reads:
    """What rules and axioms of models, beside the generic ones, are about.

    Attributes:
        properties: properties of the vocabulary that they read or conclude.
        working: whether they read of components that they work.
        failures: whether rules conclude the status of components.
        qualities: IRIs of the quality attributes whose observed levels they read.
        every_quality: whether they read the observed levels of all.
        labels: of the rules that conclude a status, by the status.
    """

    properties: frozenset[str] = frozenset()
    working: bool = False
    failures: bool = False
    qualities: frozenset[str] = frozenset()
    every_quality: bool = False
    labels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def fit(own: Sequence[Triple], loaded: Sequence[Triple], where: str) -> tuple[list[Triple], Reads]:
    """Return the triples of models so that they count beside the vocabulary and its rules, and what they are about.

    Args:
        own: triples of the vocabulary and the generic rules.
        loaded: triples of models, and of vocabularies that they bring along.
        where: the files, for messages.
    """
    declared = {subject for subject, predicate, _ in own if predicate == f"<{v.RDFS_LABEL}>"}
    triples = [triple for triple in loaded if not (triple[0] in declared and _restricts(triple))]
    rules: list[Rule] = []
    if any(value == _A_RULE for _, _, value in triples):  # most models have none, some of which are large
        rules = rules_of(Graph(triples))
        triples, rules = _Fitting(rules_of(Graph(own)), triples, rules, where).fitted()
    return triples, _reads(triples, rules)


class _Fitting:
    """The rules of models, and the parts of each."""

    def __init__(self, generic: Sequence[Rule], triples: list[Triple], rules: list[Rule], where: str) -> None:
        self._generic = [_shape(rule) for rule in generic]
        self._triples, self._rules, self._where = triples, rules, where
        self._by_subject: dict[str, list[Triple]] = defaultdict(list)
        for triple in triples:
            self._by_subject[triple[0]].append(triple)
        self._operators: dict[str, tuple[str, str]] = {}  # by quality; "": of every one
        self._added: list[Triple] = []

    def fitted(self) -> tuple[list[Triple], list[Rule]]:
        """Return the triples, and the rules that are left."""
        left = []
        gone: set[str] = set()
        for rule in self._rules:
            comparison = _comparison(rule)
            if comparison is not None:
                self._note_comparison(rule, *comparison)
            if comparison is not None or any(_alike(_shape(rule), shape) for shape in self._generic):
                gone.add(term_of(rule.node))
                continue
            left.append(rule)
            if _has_former_names(rule):
                gone.add(term_of(rule.node))
                self._rewrite(rule)
            self._check_statuses(rule)
        nodes = rule_nodes(self._triples, gone)
        kept = [triple for triple in self._triples if triple[0] not in nodes]
        return [*kept, *self._added, *self._directions(kept)], left

    def _note_comparison(self, rule: Rule, quality: str, operator: str) -> None:
        known = self._operators.setdefault(quality, (operator, rule.label))
        if known[0] != operator:
            _log.warning(
                "%s: rules %s and %s compare levels of %s in opposite ways: %s holds; set ~qa_direction if not",
                self._where,
                known[1],
                rule.label,
                local_name(quality) or "every quality",
                known[1],
            )

    def _directions(self, triples: Sequence[Triple]) -> Iterator[Triple]:
        """Yield what the comparisons say of qualities of which the models say nothing else."""
        graph = Graph(triples) if self._operators else Graph(())
        said = graph.subjects(v.QA_SIGN) | graph.subjects(v.QA_COMPARISON_OPERATOR)
        self._check_directions(graph, said)
        for quality in sorted((graph.instances(v.QA_TYPE) | graph.objects(v.IS_QA_TYPE)) - said):
            operator, _ = self._operators.get(quality) or self._operators.get("", ("", ""))
            if operator:
                yield term_of(quality), f"<{v.QA_COMPARISON_OPERATOR}>", f'"{operator}"^^<{v.XSD}string>'

    def _check_directions(self, graph: Graph, said: set[str]) -> None:
        """Warn of comparisons that contradict what the models say of a quality; that holds."""
        for quality in sorted(said & self._operators.keys()):
            operator, label = self._operators[quality]
            signs = {
                "<" if float(text) < 0 else ">" for text in graph.literals_of(quality, v.QA_SIGN) if _is_number(text)
            }
            stated = signs | {text[:1] for text in graph.literals_of(quality, v.QA_COMPARISON_OPERATOR)}
            if stated and operator[0] not in stated:
                _log.warning(
                    "%s: rule %s takes levels of %s for violations where they are %s the limit, against its %s: "
                    "the rule does not count; take it out, or correct that",
                    self._where,
                    label,
                    local_name(quality),
                    "above" if operator[0] == ">" else "below",
                    "qa_sign" if signs else "qa_comparison_operator",
                )

    def _rewrite(self, rule: Rule) -> None:
        """Add a rule with the present names. Where it reads an error of either kind, there is a rule for each kind."""
        parts = rule_nodes(self._triples, {term_of(rule.node)})
        reads = any(_former_error(atom) for atom in rule.body)
        is_of_quality = any(atom.predicate in (v.HAS_VALUE, v.HAS_QA_VALUE) for atom in rule.body)
        kinds = _ERRORS if reads else (v.IN_ERROR_NFR if is_of_quality else v.IN_ERROR_COMPONENT,)
        for number, error in enumerate(kinds):
            names = {node: f"_:k{number}x{node.strip('<>_:')}" for node in parts} if number else {}
            for node in sorted(parts):
                predicate = next((o for _, p, o in self._by_subject[node] if p == _PREDICATE), "")
                for subject, name, value in self._by_subject[node]:
                    present = _present(iri_of(predicate), value, error) if name == _ARGUMENT else value
                    self._added.append((names.get(subject, subject), name, names.get(present, present)))

    def _check_statuses(self, rule: Rule) -> None:
        for atom in rule.head:
            value = atom.arguments[-1]
            if (
                atom.predicate in _STATUS_NAMES
                and value[:1] == '"'
                and value[1:-1] not in (*_STATUSES, *_FORMER_ERRORS)
            ):
                name = local_name(atom.predicate)
                known = ", ".join(_STATUSES)
                _log.warning(
                    "%s: rule %s concludes %s %s, which nothing heeds: known: %s",
                    self._where,
                    rule.label or rule,
                    name,
                    value,
                    known,
                )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _restricts(triple: Triple) -> bool:
    """Return whether a triple restricts a property: of the vocabulary's, that is for the vocabulary to say."""
    predicate = iri_of(triple[1])
    is_functional = predicate == v.RDF_TYPE and iri_of(triple[2]) == v.OWL_FUNCTIONAL_PROPERTY
    return is_functional or predicate in (v.RDFS_DOMAIN, v.RDFS_RANGE)


# Former names


def _former_error(atom: Atom) -> bool:
    return atom.predicate in _STATUS_NAMES and atom.arguments[-1].strip('"') in _FORMER_ERRORS


def _has_former_names(rule: Rule) -> bool:
    atoms = (*rule.body, *rule.head)
    return any(
        _former_error(atom)
        or (atom.predicate == v.C_STATUS and atom.arguments[-1].strip('"') in _FORMER_COMPONENT_STATUSES)
        for atom in atoms
    )


def _present(predicate: str, value: str, error: str) -> str:
    """Return the present name for a value of a status."""
    literal = literal_of(value)
    text = literal[0] if literal else ""
    if predicate in _STATUS_NAMES and text in _FORMER_ERRORS:
        return f'"{error}"^^<{v.XSD}string>'
    if predicate == v.C_STATUS and text in _FORMER_COMPONENT_STATUSES:
        return f'"{_FORMER_COMPONENT_STATUSES[text]}"^^<{v.XSD}string>'
    return value


# Rules that say what a generic one says


def _shape(rule: Rule) -> _Shape:
    """Return the atoms of a rule without its classes, which properties imply."""
    return [
        (side + name, arguments)
        for side, atoms in (("body ", rule.body), ("head ", rule.head))
        for name, arguments in map(_part, atoms)
        if len(arguments) > 1 or name == v.FD_REALISABILITY
    ]


def _part(atom: Atom) -> tuple[str, tuple[str, ...]]:
    arguments = atom.arguments
    if atom.predicate == v.FD_UNREALISABLE_BY or (atom.predicate, arguments[-1]) == (v.FD_REALISABILITY, '"false"'):
        return v.FD_REALISABILITY, arguments[:1]
    if atom.predicate == v.C_STATUS and arguments[-1].strip('"') in _FORMER_COMPONENT_STATUSES:
        arguments = (*arguments[:-1], f'"{_FORMER_COMPONENT_STATUSES[arguments[-1].strip(chr(34))]}"')
    return _STATUS_NAMES.get(atom.predicate, atom.predicate), arguments


def _alike(some: _Shape, other: _Shape, names: Mapping[str, str] | None = None) -> bool:
    """Return whether a rule is another one but for names of variables and errors, and the order of atoms."""
    if not some or len(some) != len(other):
        return not some and not other
    for i, part in enumerate(other):
        found = _renaming(some[0], part, names or {})
        if found is not None and _alike(some[1:], [*other[:i], *other[i + 1 :]], found):
            return True
    return False


def _renaming(
    some: tuple[str, tuple[str, ...]], other: tuple[str, tuple[str, ...]], names: Mapping[str, str]
) -> dict[str, str] | None:
    """Return the names of variables by which one atom becomes the other; None if none do."""
    if some[0] != other[0] or len(some[1]) != len(other[1]):
        return None
    found = dict(names)
    for mine, its in zip(some[1], other[1], strict=True):
        if mine[:1] != "?" or its[:1] != "?":
            is_error = mine.strip('"') in _FORMER_ERRORS and its.strip('"') in _ERRORS
            if mine != its and not is_error:
                return None
        elif found.setdefault(mine, its) != its or list(found.values()).count(its) > 1:
            return None
    return found


def _comparison(rule: Rule) -> tuple[str, str] | None:
    """Return the quality (empty: every one) and the operator of a rule that does nothing but what QA does; else None.

    The operator holds between an observed level and a required one that it does not keep.
    """
    atoms = [atom for atom in rule.body if len(atom.arguments) > 1 and atom.predicate != v.SOLVES_O]
    by_name: dict[str, list[Atom]] = defaultdict(list)
    for atom in atoms:
        by_name[atom.predicate].append(atom)
    counts = {name: len(found) for name, found in by_name.items() if name not in _COMPARISONS}
    comparisons = [atom for atom in atoms if atom.predicate in _COMPARISONS]
    is_error = all(
        atom.predicate == v.O_VIOLATED_NFR
        or (atom.predicate in _STATUS_NAMES and atom.arguments[-1].strip('"') in (*_ERRORS, *_FORMER_ERRORS))
        for atom in rule.head
    )
    if not rule.head or not is_error or len(comparisons) != 1:
        return None
    if counts != {v.HAS_NFR: 1, v.HAS_QA_VALUE: 1, v.IS_QA_TYPE: 2, v.HAS_VALUE: 2}:
        return None
    required, observed = by_name[v.HAS_NFR][0].arguments[1], by_name[v.HAS_QA_VALUE][0].arguments[1]
    types = {atom.arguments[0]: atom.arguments[1] for atom in by_name[v.IS_QA_TYPE]}
    values = {atom.arguments[0]: atom.arguments[1] for atom in by_name[v.HAS_VALUE]}
    if not {required, observed} == types.keys() == values.keys() or types[required] != types[observed]:
        return None
    operator, mirrored = _COMPARISONS[comparisons[0].predicate]
    quality = "" if types[required][:1] == "?" else types[required]
    if comparisons[0].arguments == (values[observed], values[required]):
        return quality, operator
    if comparisons[0].arguments == (values[required], values[observed]):
        return quality, mirrored
    return None


# What rules and axioms are about


def _reads(triples: Iterable[Triple], rules: Sequence[Rule]) -> Reads:
    in_rules = {atom.predicate for rule in rules for atom in (*rule.body, *rule.head)}
    in_axioms = set(_in_axioms(triples))
    qualities: set[str] = set()
    for rule in rules:
        types = {atom.arguments for atom in rule.body if atom.predicate == v.IS_QA_TYPE}
        for atom in rule.body:
            if atom.predicate == v.HAS_QA_VALUE:
                qualities |= {kind for value, kind in types if value == atom.arguments[1]} or {"?"}
    labels: dict[str, list[str]] = defaultdict(list)
    for rule in rules:
        for atom in rule.head:
            if atom.predicate in _STATUS_NAMES:
                status = atom.arguments[-1].strip('"')
                for present in _ERRORS if status in _FORMER_ERRORS else (status,):
                    labels[present].append(rule.label or str(rule))
            elif atom.predicate in (v.FD_REALISABILITY, v.FD_UNREALISABLE_BY):
                labels[v.FD_REALISABILITY].append(rule.label or str(rule))
    return Reads(
        frozenset(name for name in in_rules | in_axioms if name.startswith((v.TOMASYS, v.MROS))),
        _read_working(rules) or v.C_STATUS in in_axioms,
        any(atom.predicate == v.C_STATUS for rule in rules for atom in rule.head),
        frozenset(quality for quality in qualities if quality[:1] != "?"),
        any(quality[:1] == "?" for quality in qualities) or not in_axioms.isdisjoint({v.HAS_QA_VALUE, v.HAS_VALUE}),
        {status: tuple(sorted(set(names))) for status, names in labels.items()},
    )


def _read_working(rules: Sequence[Rule]) -> bool:
    read = {atom.arguments[-1].strip('"') for rule in rules for atom in rule.body if atom.predicate == v.C_STATUS}
    return not read <= {v.FAILED, v.RECOVERED, "false"}


def _in_axioms(triples: Iterable[Triple]) -> Iterator[str]:
    """Yield the properties that class expressions and property axioms name."""
    for subject, predicate, value in triples:
        name = iri_of(predicate)
        if name in _DECLARING or name.startswith(v.SWRL):
            continue
        yield iri_of(value)
        if name in _RELATING and not iri_of(value).startswith(v.OWL):
            yield iri_of(subject)
