"""One history: a system, its settings and its faults, by a seed; and what came of it."""

from __future__ import annotations

import hashlib
import random
from collections import Counter
from dataclasses import dataclass, field

from mros1_reasoner.loop.settings import Settings as LoopSettings
from rosgraph_manipulator.change.request_queue import Policy

from simulated import systems
from simulated.faults import Fault, draw
from simulated.invariants import Invariants, unfulfilled
from simulated.manipulator import Active
from simulated.manipulator import Settings as ManipulatorSettings
from simulated.world import World

DURATION = 60.0  # s, in which faults strike
RECOVERY = 240.0  # s, simulated, after the last fault, for all to be as it should be
LOOK = 0.5  # s, simulated
MOST_FAULTS = 12


@dataclass(frozen=True)
class History:
    """What is run.

    Attributes:
        seed: of all chance in it.
        system: name of the system.
        faults: in the order of their times.
        policy: what a request does while another one is carried out.
        starts_with_initial: whether the manipulator is told what to begin with.
    """

    seed: int
    system: str
    faults: tuple[Fault, ...]
    policy: Policy = Policy.WAIT
    starts_with_initial: bool = False


@dataclass
class Outcome:
    """What came of a history.

    Attributes:
        broken: what was broken, the first first; empty: nothing.
        steps: how many events happened.
        recovery: s from the end of the faults until all was as it should be; None: it never was.
        digest: differs where two runs differ.
        counts: of faults and messages.
        told: what runs at the end, as the manipulator tells it.
    """

    broken: list[str] = field(default_factory=list)
    steps: int = 0
    recovery: float | None = None
    digest: str = ""
    counts: Counter[str] = field(default_factory=Counter)
    told: tuple[Active, ...] = ()


def history(seed: int, names: tuple[str, ...] = systems.NAMES) -> History:
    """Return the history of a seed."""
    chance = random.Random(seed)
    system = chance.choice(names)
    faults = draw(systems.load(system), chance, MOST_FAULTS, DURATION)
    return History(seed, system, faults, chance.choice(list(Policy)), chance.random() < 0.5)


def run(told: History) -> Outcome:
    """Run a history to its end, or to the first thing that is broken."""
    system = systems.load(told.system)
    first = {system.options.configurations[name].function: name for name in sorted(system.variants)}
    initial = tuple(first.values())[:1] if told.starts_with_initial else ()
    outcome = Outcome()
    world = World(system, told.seed, ManipulatorSettings(told.policy, initial), LoopSettings(), outcome.counts)
    invariants = Invariants(world)
    trace = hashlib.sha256()

    def after_step() -> None:
        invariants.look()
        if world.broken:
            raise _Stop

    world.kernel.after_step = after_step
    for fault in told.faults:
        world.kernel.at(fault.at, lambda fault=fault: world.strike(fault))
    end = max([DURATION, *(fault.at for fault in told.faults)]) if told.faults else 5.0
    try:
        world.kernel.run(end)
        world.end_faults()
        outcome.recovery = _recover(world, invariants)
    except _Stop:
        pass
    outcome.broken = list(world.broken)
    if outcome.recovery is None and not outcome.broken:
        why = "; ".join(unfulfilled(world)) or "something is under way all the time"
        outcome.broken.append(f"not recovered {RECOVERY:g} s after the last fault: {why}")
    outcome.told = tuple(world.manipulator.told.values()) if world.manipulator else ()
    outcome.steps = world.kernel.steps
    trace.update(f"{outcome.steps} {world.kernel.now!r} {world.kernel.random.random()} {outcome.broken}".encode())
    outcome.digest = trace.hexdigest()
    world.close()
    return outcome


def _recover(world: World, invariants: Invariants) -> float | None:
    """Let time pass until all is as it should be, and quiet; return the time that this took, s."""
    ended = world.kernel.now
    good_since: float | None = None
    while world.kernel.now < ended + RECOVERY:
        world.kernel.run(world.kernel.now + LOOK)
        if unfulfilled(world):
            good_since = None
        elif good_since is None:
            good_since = world.kernel.now
        if good_since is not None and invariants.is_quiet():
            return good_since - ended
    return None


class _Stop(Exception):  # noqa: N818
    """Something is broken."""
