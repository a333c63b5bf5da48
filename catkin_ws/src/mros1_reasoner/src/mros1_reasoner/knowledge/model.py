"""What the knowledge base says, as plain frozen data."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from mros1_reasoner.knowledge.vocabulary import IN_ERROR_COMPONENT, IN_ERROR_NFR

LEAST, MOST = "_min", "_max"
"""Ends of the names of limits on the other side of a band."""


class Direction(enum.Enum):
    """Whether lower or higher levels of a quality attribute are better."""

    LOWER_IS_BETTER = "lower_is_better"
    HIGHER_IS_BETTER = "higher_is_better"

    @property
    def sign(self) -> int:
        """1 if a greater level is worse, -1 if it is better (`qa_sign` in the vocabulary)."""
        return 1 if self is Direction.LOWER_IS_BETTER else -1

    @property
    def opposite(self) -> Direction:
        """The other direction."""
        return Direction.HIGHER_IS_BETTER if self is Direction.LOWER_IS_BETTER else Direction.LOWER_IS_BETTER

    def excess(self, level: float, limit: float) -> float:
        """Return by how much a level violates a limit; zero or less if it keeps the limit."""
        return self.sign * (level - limit)

    def better(self, *levels: float) -> float:
        """Return the best one of levels, at least one."""
        return min(levels) if self is Direction.LOWER_IS_BETTER else max(levels)

    @property
    def passes(self) -> str:
        """The comparison that holds between a level and a limit that it violates."""
        return ">" if self is Direction.LOWER_IS_BETTER else "<"


@dataclass(frozen=True)
class Quality:
    """A quality attribute: how its levels compare.

    Attributes:
        direction: which levels are the better ones.
        reaching_violates: whether a level that equals the limit violates it.
        low: the least possible level; None where it is not known.
        high: the greatest possible level; None where it is not known.
        typical: quality whose expected level is the usual one, where that of this quality is a high quantile.
    """

    direction: Direction = Direction.LOWER_IS_BETTER
    reaching_violates: bool = False
    low: float | None = None
    high: float | None = None
    typical: str = ""

    def other_end(self, name: str) -> str:
        """Return how a second limit of the quality of a name is called, on the other side of a band."""
        return f"{name}{LEAST if self.direction is Direction.LOWER_IS_BETTER else MOST}"

    def band(self, name: str, least: float, most: float) -> dict[str, float]:
        """Return the two limits of a band of the quality of a name, by the names of the limits."""
        is_most = self.direction is Direction.LOWER_IS_BETTER
        return {name: most if is_most else least, self.other_end(name): least if is_most else most}

    @classmethod
    def compared_by(cls, operator: str, low: float | None = None, high: float | None = None) -> Quality:
        """Return a quality whose limit is violated when the operator holds between level and limit.

        Raises:
            ValueError: it is none of `>`, `>=`, `<`, `<=`.
        """
        if operator not in (">", ">=", "<", "<="):
            raise ValueError(f"{operator!r} is not a comparison: expected >, >=, < or <=")
        direction = Direction.LOWER_IS_BETTER if operator[0] == ">" else Direction.HIGHER_IS_BETTER
        return cls(direction, operator.endswith("="), low, high)

    @property
    def operator(self) -> str:
        """The comparison that holds between a level and a limit that it violates."""
        return self.direction.passes + ("=" if self.reaching_violates else "")

    def excess(self, level: float, limit: float) -> float:
        """Return by how much a level violates a limit; negative if it keeps the limit."""
        return self.direction.excess(level, limit)

    def violates(self, level: float, limit: float) -> bool:
        """Return whether a level violates a limit."""
        excess = self.excess(level, limit)
        return excess > 0 or (self.reaching_violates and excess == 0)

    def holds(self, level: float) -> bool:
        """Return whether a level is possible."""
        above = self.low is None or level >= self.low
        return math.isfinite(level) and above and (self.high is None or level <= self.high)

    @property
    def range(self) -> str:
        """Which levels are possible, in words."""
        low, high = ("any" if end is None else f"{end:g}" for end in (self.low, self.high))
        return f"{low} to {high}"


@dataclass(frozen=True)
class Need:
    """Within which values of a property of the surroundings a design can work.

    Attributes:
        attribute: name of the property.
        least: the least such value.
        most: the greatest one.
    """

    attribute: str
    least: float = -math.inf
    most: float = math.inf

    def lack(self, value: float) -> str:
        """Return why a value does not fit, such as `light 0.1 < 0.25`; empty if it fits."""
        if value < self.least:
            return f"{self.attribute} {value:.3g} < {self.least:g}"
        return f"{self.attribute} {value:.3g} > {self.most:g}" if value > self.most else ""


@dataclass(frozen=True)
class Repair:
    """How a component that does not work can be repaired; the manipulator knows by what means.

    Attributes:
        component: name of the component.
        duration: how long it takes until the component works again, s.
        success: share of the repairs that succeed, 0 to 1.
        attempts: how often in a row it is tried.
    """

    component: str
    duration: float
    success: float = 0.8
    attempts: int = 2


@dataclass(frozen=True)
class Design:
    """A FunctionDesign; it has the name of the configuration that deploys it.

    Attributes:
        name: local name of the individual.
        function: the function that it solves.
        expected: expected level of each quality attribute.
        components: components that it cannot be deployed without, those included that fill its roles.
        requires: functions that must be provided for it to work.
        nodes: components that it brings itself, as nodes.
        needs: surroundings that it needs.
        bindings: the component that it is deployed with, by the role.
        rebinds: name of the design that it is with other bindings; empty where it is no such design.
        groups: by quality, what the design is like in all that a correction depends on; empty: corrected like all.
    """

    name: str
    function: str
    expected: Mapping[str, float] = field(default_factory=dict)
    components: frozenset[str] = frozenset()
    requires: tuple[str, ...] = ()
    nodes: frozenset[str] = frozenset()
    groups: Mapping[str, str] = field(default_factory=dict)
    needs: tuple[Need, ...] = ()
    bindings: Mapping[str, str] = field(default_factory=dict)
    rebinds: str = ""

    @property
    def root(self) -> str:
        """Name of the design, whatever its bindings are."""
        return self.rebinds or self.name

    def lacks(self, surroundings: Mapping[str, float]) -> list[str]:
        """Return why surroundings do not fit, by the values of their properties; what is not known fits."""
        known = ((need, surroundings[need.attribute]) for need in self.needs if need.attribute in surroundings)
        return [words for need, value in known if (words := need.lack(value))]

    def group(self, quality: str) -> str:
        """Return the group of designs of which a quality is corrected together."""
        return self.groups.get(quality, "")


@dataclass(frozen=True)
class Objective:
    """A function that is needed.

    Attributes:
        name: local name of the individual.
        function: the function.
        limits: the limit that each quality attribute must keep; with `_min` or `_max` behind the name, the limit on the
            other side of a band.
        always_improve: adapt also when a clearly better design has become available; None: as the settings say.
        when_required: pursued only while a deployed design requires the function.
    """

    name: str
    function: str
    limits: Mapping[str, float] = field(default_factory=dict)
    always_improve: bool | None = None
    when_required: bool = False


@dataclass(frozen=True)
class Past:
    """A decision that has been carried out, or has failed.

    Attributes:
        name: its id.
        objective: name of the objective.
        source: the design that ran before; empty: none.
        target: the design to deploy.
        state: EXECUTED or FAILED.
        stamp: when that was known, s of ROS time.
        causes: triggers of what called for it.
    """

    name: str
    objective: str
    source: str
    target: str
    state: str
    stamp: float
    causes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Facts:
    """Everything that is known at one moment: the input of an analysis.

    Attributes:
        objectives: what is needed now.
        groundings: design that is deployed for an objective, by the objective's name.
        levels: observed level, by objective and quality attribute.
        components: status of components, one of TRUE, FALSE, RECOVERED.
        broken: objectives whose grounding is known to be out of order as a whole.
        failed: objectives whose task has failed, though nothing else is known to be wrong.
        requires: objectives that the grounding of an objective requires, by the objective's name.
        tried: designs that did not keep a limit of an objective, or failed for it, as (design, objective).
        history: the last decisions, the newest last.
        surroundings: value of each property of the surroundings that has been observed.
    """

    objectives: tuple[Objective, ...] = ()
    groundings: Mapping[str, str] = field(default_factory=dict)
    levels: Mapping[tuple[str, str], float] = field(default_factory=dict)
    components: Mapping[str, str] = field(default_factory=dict)
    broken: frozenset[str] = frozenset()
    failed: frozenset[str] = frozenset()
    requires: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tried: frozenset[tuple[str, str]] = frozenset()
    history: tuple[Past, ...] = ()
    surroundings: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ObjectiveAnalysis:
    """The result of reasoning about an objective.

    Attributes:
        status: the worst o_status that holds.
        causes: every o_status that a rule concludes.
        violated: quality attributes whose limit is not kept, sorted.
        grounding_causes: every fg_cause of its grounding that holds.
        grounding_status: the worst of them, empty without an error.
    """

    status: str
    causes: frozenset[str] = frozenset()
    violated: tuple[str, ...] = ()
    grounding_causes: frozenset[str] = frozenset()
    grounding_status: str = ""

    @property
    def in_error(self) -> bool:
        """Whether the objective is not fulfilled as it should be."""
        return bool(self.causes & {IN_ERROR_NFR, IN_ERROR_COMPONENT})


@dataclass(frozen=True)
class Analysis:
    """The statuses that follow from facts.

    Attributes:
        objectives: by name.
        unrealisable: designs that can't be deployed, each with the components that keep it from that; none of these
            where a rule of the model says so, where only a function that it requires can't be fulfilled, or where the
            surroundings do not fit.
        tried: designs that do not keep their objective's limits while deployed, as (design, objective).
    """

    objectives: Mapping[str, ObjectiveAnalysis] = field(default_factory=dict)
    unrealisable: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tried: frozenset[tuple[str, str]] = frozenset()
