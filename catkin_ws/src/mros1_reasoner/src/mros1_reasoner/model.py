"""What the knowledge base says, as plain frozen data."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field


class Direction(enum.Enum):
    """Which levels of a quality attribute are the better ones."""

    LOWER_IS_BETTER = "lower_is_better"
    HIGHER_IS_BETTER = "higher_is_better"

    @property
    def sign(self) -> int:
        """1 or -1: a level times it is worse the greater it is (`qa_sign` in the vocabulary)."""
        return 1 if self is Direction.LOWER_IS_BETTER else -1

    def excess(self, level: float, limit: float) -> float:
        """Return by how much a level passes a limit; zero or less where it keeps it."""
        return self.sign * (level - limit)

    @property
    def passes(self) -> str:
        """The comparison that holds between a level and the limit that it does not keep."""
        return ">" if self is Direction.LOWER_IS_BETTER else "<"


@dataclass(frozen=True)
class Design:
    """A FunctionDesign: its name is that of the configuration which deploys it.

    Attributes:
        name: local name of the individual.
        function: the function that it solves.
        expected: expected level of each quality attribute.
        components: components that it cannot be deployed without.
        requires: functions that must be provided for it to work.
    """

    name: str
    function: str
    expected: Mapping[str, float] = field(default_factory=dict)
    components: frozenset[str] = frozenset()
    requires: tuple[str, ...] = ()


@dataclass(frozen=True)
class Objective:
    """A function that is needed, and the limit that each quality attribute must keep."""

    name: str
    function: str
    limits: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Facts:
    """Everything that is known at one moment, as an analysis takes it.

    Attributes:
        objectives: what is needed now.
        groundings: design that is deployed for an objective, by the objective's name.
        levels: observed level, by objective and quality attribute.
        components: status of components, one of TRUE, FALSE, RECOVERED.
        broken: objectives whose grounding is known to be out of order as a whole.
    """

    objectives: tuple[Objective, ...] = ()
    groundings: Mapping[str, str] = field(default_factory=dict)
    levels: Mapping[tuple[str, str], float] = field(default_factory=dict)
    components: Mapping[str, str] = field(default_factory=dict)
    broken: frozenset[str] = frozenset()


@dataclass(frozen=True)
class ObjectiveAnalysis:
    """What reasoning says of an objective.

    Attributes:
        status: its o_status, derived from the causes.
        causes: every o_cause that holds.
        violated: quality attributes whose limit is not kept, sorted.
        grounding_status: fg_status of its grounding, empty without an error.
    """

    status: str
    causes: frozenset[str] = frozenset()
    violated: tuple[str, ...] = ()
    grounding_status: str = ""


@dataclass(frozen=True)
class Analysis:
    """The statuses that follow from facts.

    Attributes:
        objectives: by name.
        unrealisable: components that keep a design from being deployed, by the design's name; others can be.
        tried: designs that do not keep their objective's limits while deployed, as (design, objective).
    """

    objectives: Mapping[str, ObjectiveAnalysis] = field(default_factory=dict)
    unrealisable: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tried: frozenset[tuple[str, str]] = frozenset()
