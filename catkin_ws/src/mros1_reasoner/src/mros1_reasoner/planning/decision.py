"""What the loop decides, as plain frozen data: everything that a person needs to follow an adaptation or a refusal."""

from __future__ import annotations

from dataclasses import dataclass, field

from metacontrol_msgs import msg as messages

from mros1_reasoner.planning.planner import Candidate

DECIDED, EXECUTED, FAILED = messages.Decision.DECIDED, messages.Decision.EXECUTED, messages.Decision.FAILED
PROPOSED = messages.Decision.PROPOSED  # waits for an operator's approval
ADVISED = messages.Decision.ADVISED  # in a dry run: nothing follows
RECOVERY = "compRecov"  # the rule by which the return of a component is a cause
OPERATOR = "operator"


@dataclass(frozen=True)
class Cause:
    """Something that asks for an adaptation.

    Attributes:
        stamp: since when it holds, s of ROS time.
        trigger: its kind and name: component:NAME, qa:NAME, task:NAME, initial, operator.
        text: the cause in words.
        rules: labels of the rules that conclude it, separated by commas; empty where none is needed.
        quality: the quality attribute whose limit is passed; empty for other causes.
        level: the observed level of it.
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
    def is_chance(self) -> bool:
        """Whether nothing is wrong, but a better design may have become available."""
        return self.rules == RECOVERY or self.trigger == OPERATOR


@dataclass(frozen=True)
class Decision:
    """An adaptation or a refusal of one, explained: the fields of metacontrol_msgs/Decision and some more.

    Attributes:
        causes: every cause in words, the first one first.
        reasons: the same causes with levels, limits and rules.
        candidates: ranked, best first, each with the reason why it lost.
        corrections: by what the expected levels were corrected, in words.
        releases: objectives that are no longer needed once it is carried out.
        wall_began: wall time at which it was decided, from which `execute_wall_s` counts.
    """

    id: str
    state: str
    objective: str
    trigger: str
    causes: tuple[str, ...]
    from_configuration: str
    to_configuration: str
    degraded: bool
    candidates: tuple[Candidate, ...]
    explanation: str
    stamp_monitored: float
    stamp_analysed: float
    stamp_planned: float
    stamp_executed: float = 0.0
    analyse_wall_s: float = 0.0
    plan_wall_s: float = 0.0
    execute_wall_s: float = 0.0
    reasons: tuple[Cause, ...] = ()
    corrections: tuple[str, ...] = ()
    releases: tuple[str, ...] = ()
    wall_began: float = field(default=0.0, compare=False)
