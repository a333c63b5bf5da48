"""What goes wrong in a mission, and when: a pure function of a seed and the mission's number."""

from __future__ import annotations

import enum
import random
from dataclasses import dataclass

DRIVERS = ("front_laser", "rear_laser", "camera", "battery_load_control", "robot_state_publisher")
PARTS = ("rosgraph_monitor", "reasoner", "rosgraph_manipulator", "rosgraph_launcher")
NODE = "move_base"
RECORDER = "mission_recorder"
PELLET = "pellet"
"""Roles of the processes of a mission: the names of nodes, and Pellet's process."""

ROUTES = ("r1", "r2", "r3", "r4", "r5", "r6")
FIRST = ("f2_v2_r2", "f1_v2_r1", "f3_v2_r3", "f1_v1_r3")
"""Variants that are deployed at the start."""
FAULTS_EACH = 7
"""Faults of a mission."""
PHASES = ("begun", "stops", "starts")
"""Of a change: it has just begun; a node of it has just ended; a new one has just started."""
SPOILED = ("nan", "infinite", "wrong frame", "wrong size", "empty", "future", "past", "repeat", "flood")
"""How data are wrong."""
FILES = ("launch/variants", "models/d2.owl", "config", "models/variants")
FILES_HOW = ("deleted", "truncated", "changed")


class Kind(enum.Enum):
    """The kinds of faults, in the groups of the report."""

    KILL = "process killed"
    FREEZE = "process stopped for a while"
    FREEZE_FOR_GOOD = "process stopped for good"
    INTERRUPT = "process interrupted"
    KILL_TWO = "two processes killed at once"
    KILL_IN_CHANGE = "process killed in a phase of a change"
    KILL_STARTING = "node killed while it starts"
    KILL_SIMULATOR = "simulator killed"

    PARAMETERS = "parameters rewritten"
    USURP = "name taken by somebody else"
    KILL_MASTER = "master killed"
    FREEZE_MASTER = "master stopped for a while"
    SLOW_MASTER = "master answers slowly"
    BREAKING_MASTER = "connections to the master broken"
    REFUSING_MASTER = "master refuses connections for good"
    DEAF_SUBSCRIBER = "subscriber that never reads"
    HALF_OPEN = "half-open connections"

    DATA = "wrong data on a topic"
    SERVICE = "wrong data to a service"

    DISK_FULL = "disk full"
    MEMORY = "memory limited"
    DESCRIPTORS = "descriptors used up"
    CPU = "CPU taken by others"
    CLOCK_STANDS = "clock stands"
    CLOCK_JUMPS = "clock jumps"

    FILES = "files deleted, truncated or changed"

    @property
    def ends_mission(self) -> bool:
        """Whether no mission can go on after it: it is the last fault of its mission.

        A master that refuses two connections, 0.1 s apart, counts as gone, and rospy never registers at another one.
        """
        return self in (Kind.KILL_MASTER, Kind.KILL_SIMULATOR, Kind.REFUSING_MASTER)


GROUPS = {
    "processes": tuple(Kind)[:8],
    "master and network": tuple(Kind)[8:17],
    "data": tuple(Kind)[17:19],
    "machine": tuple(Kind)[19:25],
    "files": tuple(Kind)[25:],
}
"""As the report has them."""

_WEIGHTS = {Kind.KILL: 5, Kind.FREEZE: 3, Kind.KILL_IN_CHANGE: 4, Kind.DATA: 6, Kind.USURP: 2, Kind.PARAMETERS: 2}
_WEIGHTS |= {Kind.SERVICE: 2, Kind.FILES: 2, Kind.INTERRUPT: 2}
"""How often a kind is in one deck; once where nothing is said. What has more variety comes more often."""

_FOR_GOOD = {Kind.KILL, Kind.FREEZE_FOR_GOOD, Kind.INTERRUPT, Kind.KILL_TWO, Kind.KILL_IN_CHANGE, Kind.KILL_STARTING}
_FOR_GOOD |= {Kind.PARAMETERS, Kind.SERVICE, Kind.CLOCK_JUMPS, Kind.BREAKING_MASTER}
"""Nobody takes them back."""

_WAYS = {
    Kind.KILL_IN_CHANGE: PHASES,
    Kind.PARAMETERS: ("drift", "wrong type", "deleted", "huge"),
    Kind.DATA: SPOILED,
    Kind.SERVICE: ("nan", "infinite", "empty", "wrong size", "repeat"),
    Kind.CLOCK_JUMPS: ("ahead", "back"),
    Kind.FILES: FILES_HOW,
}


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        kind: its kind.
        at: when it strikes, wall s after the goal was sent.
        targets: roles of the processes that it hits.
        how: what exactly happens, where a kind has several ways.
        lasts: s until it is taken back; 0: never, or nothing is left to be taken back.
        pick: 0 to 1, which one of what is found when it strikes.
    """

    kind: Kind
    at: float
    targets: tuple[str, ...] = ()
    how: str = ""
    lasts: float = 0.0
    pick: float = 0.0

    def __str__(self) -> str:
        """Return it in one line."""
        words = [self.kind.value, " and ".join(self.targets), self.how, f"for {self.lasts:g} s" if self.lasts else ""]
        return f"{self.at:g} s: " + ", ".join(filter(None, words))


@dataclass(frozen=True)
class Mission:
    """A mission.

    Attributes:
        number: of the mission, from 0.
        seed: of its simulation.
        route: its route.
        configuration: the variant deployed first.
        engine: what infers, `pellet` or `rules`.
        faults: in the order of their times.
    """

    number: int
    seed: int
    route: str
    configuration: str
    engine: str
    faults: tuple[Fault, ...]

    @property
    def proxied(self) -> bool:
        """Whether a proxy stands before the master."""
        return any(
            fault.kind in (Kind.SLOW_MASTER, Kind.BREAKING_MASTER, Kind.REFUSING_MASTER) for fault in self.faults
        )

    @property
    def small_disk(self) -> bool:
        """Whether logs, bag and ROS_HOME are on a small disk."""
        return any(fault.kind is Kind.DISK_FULL for fault in self.faults)


def mission(seed: int, number: int) -> Mission:
    """Return the mission of a number, counted from 0, in the soak of a seed."""
    draw = random.Random(f"mission {seed} {number}")
    kinds = sorted(_dealt(seed, number), key=lambda kind: kind.ends_mission)
    while sum(kind.ends_mission for kind in kinds) > 1:
        kinds.pop()
    engine = draw.choices(("pellet", "rules"), (3, 1))[0]
    faults, at = [], draw.uniform(2.0, 6.0)
    for kind in kinds:
        fault = _fault(kind, round(at, 1), engine, draw)
        faults.append(fault)
        at += fault.lasts * draw.choice((0.0, 0.5, 1.0)) + draw.uniform(2.0, 6.0)
    return Mission(number, draw.randrange(1, 2**31), draw.choice(ROUTES), draw.choice(FIRST), engine, tuple(faults))


def _dealt(seed: int, number: int) -> list[Kind]:
    """Return the kinds of a mission: dealt from decks that have every kind, so that none stays away for long."""
    deck = [kind for kind in Kind for _ in range(_WEIGHTS.get(kind, 1))]
    dealt: list[Kind] = []
    for place in range(number * FAULTS_EACH, (number + 1) * FAULTS_EACH):
        turn, card = divmod(place, len(deck))
        shuffled = list(deck)
        random.Random(f"deck {seed} {turn}").shuffle(shuffled)
        dealt.append(shuffled[card])
    return dealt


def _fault(kind: Kind, at: float, engine: str, draw: random.Random) -> Fault:
    """Return a fault of a kind, with what the kind leaves open drawn."""
    lasts = 0.0 if kind in _FOR_GOOD or kind.ends_mission else round(draw.uniform(2.0, 8.0), 1)
    how = draw.choice(_WAYS.get(kind, ("",)))
    return Fault(kind, at, _targets(kind, engine, draw), how, lasts, round(draw.random(), 4))


def _targets(kind: Kind, engine: str, draw: random.Random) -> tuple[str, ...]:
    """Return what a fault of a kind hits."""
    own = [*PARTS, NODE] + [PELLET] * (engine == "pellet")
    if kind is Kind.KILL_TWO:
        return tuple(sorted(draw.sample([*own, *DRIVERS], 2)))
    if kind in (Kind.KILL, Kind.FREEZE, Kind.INTERRUPT):
        among = [*own, *DRIVERS, RECORDER] if draw.random() < 0.3 else own
    else:
        among = {
            Kind.FREEZE_FOR_GOOD: [*own, *DRIVERS],
            Kind.KILL_IN_CHANGE: own,
            Kind.KILL_STARTING: [NODE],
            Kind.USURP: [*PARTS, NODE, "front_laser"],
            Kind.FILES: list(FILES),
            **{one: [*PARTS, NODE] for one in (Kind.HALF_OPEN, Kind.MEMORY, Kind.DESCRIPTORS, Kind.DEAF_SUBSCRIBER)},
        }.get(kind, [])
    return (draw.choice(among),) if among else ()
