"""Inputs and results of the loop, as typed entries of its journal; `entry_text` converts them to and from text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

# R1: facts


@dataclass(frozen=True, slots=True)
class LevelFact:
    """A quality attribute has a level.

    Attributes:
        quality: name of the quality attribute.
        level: the level.
        grounding: what it was observed of; empty or unknown: of everything that runs.
        stamp: of the diagnostic, s; 0 where it has none.
        text: the level as the diagnostic has it; the journal is without it.
    """

    quality: str
    level: float
    grounding: str = ""
    stamp: float = 0.0
    text: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class StaleFact:
    """A quality attribute can't be observed at present; the journal lacks the reason."""

    quality: str
    reason: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class ComponentFact:
    """A component has a status; the diagnostic has a stamp, s, and may tell why the component has failed."""

    component: str
    status: str
    stamp: float = 0.0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class DriftFact:
    """Parameters of a node do not have the values of what is deployed.

    Attributes:
        node: its name; GRAPH of DiagnosticWords: they are the system's.
        parameters: their names, separated by commas.
        configurations: the deployed configurations that set them, separated by commas.
        stamp: of the diagnostic, s; 0 where it has none.
    """

    node: str
    parameters: str
    configurations: str
    stamp: float = 0.0


@dataclass(frozen=True, slots=True)
class BindingFact:
    """A binding of a grounding is in error, or no longer is."""

    grounding: str
    in_error: bool


@dataclass(frozen=True, slots=True)
class TaskFact:
    """The task of an objective has failed, or no longer has.

    Attributes:
        name: of the objective or of its function; any other name stands for the only root objective.
        failed: whether the task has failed.
        stamp: of the message that said so, s; 0 where it has none.
        message: why.
    """

    name: str
    failed: bool
    stamp: float = 0.0
    message: str = ""


@dataclass(frozen=True, slots=True)
class ActiveFact:
    """A configuration runs for a function, in a state of metacontrol_msgs/FunctionGrounding; empty: nothing does."""

    function: str
    configuration: str
    state: str


@dataclass(frozen=True, slots=True)
class LeftFact:
    """A reasoner that has died had left a better design of an objective, and waited for its way back.

    Attributes:
        objective: the objective.
        design: what ran for it then; empty: nothing.
        quality: for the sake of which it was left; empty: of none.
        factor: observed levels were then so many times the expected ones,
        difference: or differed from them by so much.
        group: of designs that are corrected together, in which the design that was left is.
        degraded: whether what ran did not keep every limit.
    """

    objective: str
    design: str
    quality: str = ""
    factor: float = 1.0
    difference: float = 0.0
    group: str = ""
    degraded: bool = False


@dataclass(frozen=True, slots=True)
class FailedFact:
    """A component did not work when a reasoner died: if it works now, that is news."""

    component: str


@dataclass(frozen=True, slots=True)
class UnneededFact:
    """Nothing needed a function any longer when a reasoner died, which had not released it yet."""

    function: str


BeforeFact = LeftFact | FailedFact | UnneededFact
"""What a reasoner that has died tells the one that takes its place."""

Fact = LevelFact | StaleFact | ComponentFact | DriftFact | BindingFact | TaskFact | ActiveFact | BeforeFact

# What an operator asks for


@dataclass(frozen=True, slots=True)
class Pause:
    """Decide nothing."""


@dataclass(frozen=True, slots=True)
class Resume:
    """Decide again."""


@dataclass(frozen=True, slots=True)
class Lock:
    """Keep the configuration of an objective; of all objectives if none is named."""

    objective: str = ""


@dataclass(frozen=True, slots=True)
class Unlock:
    """Release a lock; all locks if no objective is named."""

    objective: str = ""


@dataclass(frozen=True, slots=True)
class Approve:
    """Carry out the proposed decision of this id."""

    decision: str


@dataclass(frozen=True, slots=True)
class Reject:
    """Do not carry out the proposed decision of this id."""

    decision: str


@dataclass(frozen=True, slots=True)
class AddObjective:
    """Ask for a function, with limits of quality attributes."""

    name: str
    function: str
    limits: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Pursue:
    """Ask for a function with these limits, and no others, by an objective that may exist already.

    Attributes:
        name: of the objective.
        function: the function.
        limits: of quality attributes.
        always_improve: adapt also when a clearly better design has become available; None: as the settings say.
    """

    name: str
    function: str
    limits: Mapping[str, float]
    always_improve: bool | None = None


@dataclass(frozen=True, slots=True)
class RemoveObjective:
    """Ask for an objective's function no longer."""

    name: str


@dataclass(frozen=True, slots=True)
class SetNfr:
    """Give an objective another limit; all objectives if none is named."""

    objective: str
    quality: str
    limit: float


Command = Pause | Resume | Lock | Unlock | Approve | Reject | AddObjective | Pursue | RemoveObjective | SetNfr

# What the loop does


@dataclass(frozen=True, slots=True)
class Step:
    """Reason and decide; on a heartbeat, also if only a level has changed."""

    heartbeat: bool


@dataclass(frozen=True, slots=True)
class Result:
    """A decision was carried out, or was not.

    Attributes:
        decision: its id.
        ok: whether it was carried out.
        message: why not.
        blame: whether the configuration is to blame for the failure.
    """

    decision: str
    ok: bool
    message: str = ""
    blame: bool = True


@dataclass(frozen=True, slots=True)
class Decided:
    """The decision to which the entry before has led: its id, objective and configuration."""

    decision: str
    objective: str
    configuration: str


@dataclass(frozen=True, slots=True)
class Released:
    """A function that nothing needed any longer was released."""

    function: str


Content = Fact | Command | Step | Result | Decided | Released


@dataclass(frozen=True, slots=True)
class Entry:
    """An input or an action of the loop, with its ROS time in s."""

    now: float
    content: Content


def subject(fact: Fact) -> tuple[str, ...]:
    """Return the subject of a fact: a later fact about the same subject replaces it."""
    found: tuple[str, ...]
    match fact:
        case LevelFact():
            found = ("level", fact.quality, fact.grounding)
        case StaleFact():
            found = ("stale", fact.quality)
        case ComponentFact():
            found = ("component", fact.component)
        case DriftFact():
            found = ("drift", fact.node)
        case BindingFact():
            found = ("binding", fact.grounding)
        case TaskFact():
            found = ("task", fact.name)
        case ActiveFact():
            found = ("active", fact.function)
        case LeftFact():
            found = ("left", fact.objective, fact.quality)
        case FailedFact():
            found = ("failed", fact.component)
        case UnneededFact():
            found = ("unneeded", fact.function)
    return found
