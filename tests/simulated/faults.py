"""What goes wrong, and what people ask for meanwhile: a list of faults, drawn from a seed, that can be shortened."""

from __future__ import annotations

import enum
import random
from collections.abc import Sequence
from dataclasses import dataclass

from simulated.systems import System


class Kind(enum.Enum):
    """The kinds of faults; `value` of a fault is in s where nothing else is said."""

    KILL_PART = "part killed"  # the launcher starts again after `value`; 0, and any other part: after a usual time
    DISMISS_PART = "part told to end"
    FREEZE_PART = "part hangs"  # for `value`
    KILL_NODE = "node killed"
    FREEZE_NODE = "node hangs"  # for `value`; 0: for ever
    KILL_DRIVER = "driver killed"  # starts again after `value`; 0: never
    DIES_AT_START = "node dies at its start"  # `value` times
    NEVER_READY = "node never ready"  # for `value`
    DIES_LATER = "node dies again and again"  # `value` after it is ready, until the faults end
    DEAF = "node ignores the request to end"
    SLOW = "messages delayed"  # of one topic, for `value`
    RECONNECT = "connections made anew"  # messages are lost, latched ones doubled
    MASTER_SILENT = "master silent"  # for `value`
    CLOCK_STANDS = "ROS clock stands"  # for `value`
    CLOCK_JUMPS = "ROS clock jumps"  # by `value`
    WALL_JUMPS = "wall clock jumps"  # by `value`
    FOREIGN = "name taken by somebody else"  # for `value`
    DRIFT = "parameter overwritten"
    FILE_GONE = "launch file gone"  # for `value`
    REQUEST = "somebody requests a configuration"
    CANCELLED_REQUEST = "a request is taken back"  # after `value`
    LOCK = "operator locks"  # for `value`
    PAUSE = "operator pauses"  # for `value`


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        at: when it strikes, s.
        kind: its kind.
        target: the part, node, topic, configuration or objective that it hits.
        value: see Kind.
    """

    at: float
    kind: Kind
    target: str = ""
    value: float = 0.0

    def __str__(self) -> str:
        """Return the fault as code."""
        target = f', "{self.target}"' if self.target or self.value else ""
        return f"Fault({self.at}, Kind.{self.kind.name}{target}{f', {self.value}' if self.value else ''})"


PARTS = ("launcher", "manipulator", "monitor", "reasoner")
TOPICS = ("active", "diagnostics", "functions")
_OFTEN = {Kind.KILL_PART: 5, Kind.KILL_NODE: 5, Kind.REQUEST: 3, Kind.KILL_DRIVER: 2, Kind.FREEZE_NODE: 2}
_LOW, _HIGH = 0.2, 20.0
_VALUES: dict[Kind, tuple[float, float]] = {
    Kind.FREEZE_PART: (0.1, 25.0),
    Kind.DIES_LATER: (0.05, 8.0),
    Kind.SLOW: (0.5, 5.0),
    Kind.MASTER_SILENT: (0.1, 5.0),
    Kind.CLOCK_STANDS: (0.5, 10.0),
    Kind.CLOCK_JUMPS: (-600.0, 120.0),
    Kind.WALL_JUMPS: (-100.0, 100.0),
    Kind.CANCELLED_REQUEST: (0.0, 3.0),
}
_NO_VALUE = frozenset(
    {Kind.KILL_PART, Kind.DISMISS_PART, Kind.KILL_NODE, Kind.DEAF, Kind.RECONNECT, Kind.DRIFT, Kind.REQUEST}
)


def draw(system: System, chance: random.Random, most: int, duration: float) -> tuple[Fault, ...]:
    """Return faults in the order of their times.

    Args:
        system: that they hit.
        chance: where they come from.
        most: how many there are at most.
        duration: in which they strike, s.
    """
    kinds = list(Kind)
    weights = [_OFTEN.get(kind, 1) for kind in kinds]
    faults: list[Fault] = []
    for _ in range(chance.randint(1, most)):
        (kind,) = chance.choices(kinds, weights)
        at = chance.uniform(0.0, duration)
        if faults and chance.random() < 0.5:  # many defects need two faults at nearly the same time
            at = faults[-1].at + chance.expovariate(1.0)
        faults.append(Fault(round(at, 3), kind, target := _target(system, kind, chance), _value(kind, target, chance)))
    return tuple(sorted(faults, key=lambda fault: fault.at))


def _target(system: System, kind: Kind, chance: random.Random) -> str:
    base = sorted(system.base_nodes)
    own = sorted({node for described in system.described.values() for node in described.nodes})
    if kind is Kind.FREEZE_NODE and chance.random() < 0.2:
        return chance.choice(base)
    names = {name for described in system.described.values() for name in described.all_parameters()}
    among: dict[Kind, Sequence[str]] = {
        **dict.fromkeys((Kind.KILL_PART, Kind.DISMISS_PART, Kind.FREEZE_PART), PARTS),
        **dict.fromkeys((Kind.SLOW, Kind.RECONNECT), TOPICS),
        **dict.fromkeys((Kind.REQUEST, Kind.CANCELLED_REQUEST, Kind.FILE_GONE), sorted(system.variants)),
        **dict.fromkeys((Kind.MASTER_SILENT, Kind.CLOCK_STANDS, Kind.CLOCK_JUMPS, Kind.WALL_JUMPS, Kind.PAUSE), ("",)),
        Kind.KILL_DRIVER: base,
        Kind.LOCK: ["", *_objectives(system)],
        Kind.DRIFT: sorted(names),
    }
    return chance.choice(among.get(kind, own))


def _objectives(system: System) -> list[str]:
    """Return the names of the objectives that there are, and of those that designs may require."""
    required = {function for design in system.knowledge.designs.values() for function in design.requires}
    pursued = {objective.function: objective.name for objective in system.objectives}
    names = {function: f"o_{function.removeprefix('f_')}" for function in required} | pursued
    return sorted(set(names.values()))


def _value(kind: Kind, target: str, chance: random.Random) -> float:
    if kind is Kind.KILL_PART and target == "launcher" and chance.random() < 0.4:
        return round(chance.uniform(_LOW, _HIGH), 3)
    if kind in _NO_VALUE:
        return 0.0
    if kind is Kind.DIES_AT_START:
        return float(chance.randint(1, 5))
    if kind in (Kind.FREEZE_NODE, Kind.KILL_DRIVER) and chance.random() < 0.4:
        return 0.0
    return round(chance.uniform(*_VALUES.get(kind, (_LOW, _HIGH))), 3)
