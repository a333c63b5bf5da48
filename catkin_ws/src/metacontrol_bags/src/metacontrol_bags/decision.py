"""A decision of the reasoner with its explanation, as a record that all packages share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from metacontrol_bags import words

PROPOSED = words.Decision.PROPOSED
ADVISED = words.Decision.ADVISED
DECIDED = words.Decision.DECIDED
EXECUTED = words.Decision.EXECUTED
FAILED = words.Decision.FAILED
"""States of a decision; `metacontrol_msgs/Decision` says what each means."""

RELIEF = "relief"
"""The rule by which the end of a violation's cause is a cause."""


@dataclass(frozen=True)
class Cause:
    """Something that asks for an adaptation: a `metacontrol_msgs/Cause`.

    Attributes:
        stamp: since when it holds, s of ROS time.
        trigger: its kind and name: component:NAME, qa:NAME, task:NAME, parameter:NODE, initial, operator.
        text: the cause in words.
        rules: labels of the rules that conclude it, separated by commas; empty where none is needed.
        quality: the quality attribute whose limit is passed; empty for other causes.
        level: the observed level of the quality attribute.
        limit: the limit.
        excess: by how much the level passes the limit, as a share of the limit.
    """

    stamp: float
    trigger: str
    text: str
    rules: str = ""
    quality: str = ""
    level: float = 0.0
    limit: float = 0.0
    excess: float = 0.0

    @property
    def passes_limit(self) -> bool:
        """Whether a level passes its limit; not where the cause of a violation is gone."""
        return bool(self.quality) and self.rules != RELIEF


@dataclass(frozen=True)
class Candidate:
    """A function design that was considered: a `metacontrol_msgs/Candidate`.

    Attributes:
        name: of the function design.
        expected: level that the model expects, by quality attribute.
        levels: level that was compared with the limit, by quality attribute: the observed level of the deployed
            design, the expected and corrected level of every other one.
        utility: how useful the design is expected to be.
        chosen: whether the design was taken.
        refused_because: why the design can't be taken; empty for the chosen one and for those that are less useful.
        lost_because: why the design was not taken; empty for the chosen one only.
    """

    name: str
    expected: Mapping[str, float] = field(default_factory=dict)
    levels: Mapping[str, float] = field(default_factory=dict)
    utility: float = 0.0
    chosen: bool = False
    refused_because: str = ""
    lost_because: str = ""


@dataclass(frozen=True)
class Decision:
    """An adaptation or the refusal of one: a `metacontrol_msgs/Decision`; stamps are s of ROS time.

    Attributes:
        id: the same in all messages about one decision.
        state: PROPOSED, ADVISED, DECIDED, EXECUTED or FAILED.
        objective: the objective that is violated.
        trigger: kind and name of the first cause.
        from_configuration: what runs; empty where nothing does.
        to_configuration: what shall run; empty where nothing can be done.
        stamp: of the message; 0 before it is published.
        degraded: whether no candidate keeps every limit.
        causes: every cause in words, the first one first.
        reasons: the same causes with levels, limits and rules.
        candidates: ranked, best first.
        corrections: by what the expected levels were corrected, in words.
        releases: objectives that are no longer needed once the decision is carried out.
        repair: component to repair in place of a change; empty: none. The message tells it in its explanation only.
        explanation: one line for people.
        stamp_monitored: R1, of the diagnostic that reported the first cause.
        stamp_analysed: R2 is done.
        stamp_planned: R3 is done.
        stamp_executed: R4 is done; 0 before.
        analyse_wall_s: wall time that R2 took.
        plan_wall_s: wall time that R3 took.
        execute_wall_s: wall time that R4 took; 0 before.
    """

    id: str
    state: str
    objective: str
    trigger: str
    from_configuration: str
    to_configuration: str
    stamp: float = 0.0
    degraded: bool = False
    causes: tuple[str, ...] = ()
    reasons: tuple[Cause, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    corrections: tuple[str, ...] = ()
    releases: tuple[str, ...] = ()
    repair: str = ""
    explanation: str = ""
    stamp_monitored: float = 0.0
    stamp_analysed: float = 0.0
    stamp_planned: float = 0.0
    stamp_executed: float = 0.0
    analyse_wall_s: float = 0.0
    plan_wall_s: float = 0.0
    execute_wall_s: float = 0.0


def milliseconds(duration: float) -> str:
    """Return a duration, given in s, as text in ms."""
    return f"{duration * 1000:.1f} ms"
