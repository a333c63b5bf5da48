"""The nodes of the configuration that runs: which to stop, keep and start, and what follows when one ends.

Times are arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

import enum
from collections.abc import Collection, Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_manipulator.launching.restarts import DeathCounter, RestartPolicy

Kind = TypeVar("Kind", bound=Hashable)

OFFER_AGE = 1.0  # s after a node's start: by then it has advertised its topics and services
STANDBY_DELAY = 0.5  # s after a change: the imports of a warm process must not slow the new nodes down


class Verdict(enum.Enum):
    """What follows from the end of a node."""

    FINISHED = "finished"  # it has done its work
    RESTART = "restart"  # it is started again after a delay
    GIVE_UP = "give up"  # its configuration is stopped


@dataclass(frozen=True)
class Ending:
    """The end of a node.

    Attributes:
        verdict: what follows.
        text: a line for the operator.
    """

    verdict: Verdict
    text: str


@dataclass(frozen=True)
class _Node:
    """A node that should run.

    Attributes:
        description: how it is started.
        started: when its process began; None: it has no process.
        restart_at: when it is started again; None: it is not due.
        serves: whether it has topics or services of its own; None: nobody has looked yet.
        finished: whether it has done its work and ended.
    """

    description: NodeDescription
    started: float | None = None
    restart_at: float | None = None
    serves: bool | None = None
    finished: bool = False


class ManagedNodes:
    """The nodes of one configuration and the state that the launcher reports."""

    def __init__(self, policy: RestartPolicy) -> None:
        self._policy = policy
        self._deaths = DeathCounter(policy)
        self._nodes: dict[str, _Node] = {}
        self._configuration, self._message = "", ""
        self._state = STABLE
        self._changes = 0
        self._changed_at = float("-inf")

    # -- what runs ------------------------------------------------------------------------------------------------

    @property
    def changes(self) -> int:
        """Number of the changes that were asked for."""
        return self._changes

    @property
    def names(self) -> tuple[str, ...]:
        """All nodes of the configuration, also those that have done their work."""
        return tuple(self._nodes)

    def description(self, name: str) -> NodeDescription:
        """Return how a node is started."""
        return self._nodes[name].description

    def report(self) -> LauncherReport:
        """Return what the launcher tells."""
        unfinished = {name: node for name, node in self._nodes.items() if not node.finished}
        dead = tuple(name for name, node in unfinished.items() if node.started is None)
        return LauncherReport(self._configuration, self._changes, self._state, tuple(unfinished), dead, self._message)

    # -- changes --------------------------------------------------------------------------------------------------

    def ask_for_change(self) -> None:
        """Count a change that was asked for."""
        self._changes += 1

    def refusal(self, system: SystemDescription, start: Collection[str]) -> str:
        """Return why a change can't be made; empty where it can.

        A change may have been planned for a launcher that died since and that had more nodes.
        """
        unknown = [name for name in start if name not in system.nodes]
        if unknown:
            return f"starts no node {', '.join(unknown)}"
        lacking = [name for name in system.nodes if name not in start and name not in self._nodes]
        return f"needs {', '.join(lacking)}, which does not run: start it, too" if lacking else ""

    def begin_change(self, system: SystemDescription, start: Collection[str]) -> list[str]:
        """Begin a change, and return the running nodes that must end.

        Nodes end that the configuration lacks or that are started anew. All others run on.
        """
        self._state, self._message = CHANGING, ""
        return [name for name in self._nodes if name in start or name not in system.nodes]

    def adopt(self, configuration: str, system: SystemDescription, start: Collection[str]) -> None:
        """Note that the nodes of a configuration are those in `start` and those that ran before and are kept."""
        if configuration != self._configuration:
            self._deaths.reset()
        kept = {name: node for name, node in self._nodes.items() if name in system.nodes and name not in start}
        self._nodes = {
            name: replace(kept[name], description=description) if name in kept else _Node(description)
            for name, description in system.nodes.items()
            if name in kept or name in start
        }
        self._configuration, self._message = configuration, ""

    def end_change(self, now: float, failed_to_start: Iterable[str] = ()) -> None:
        """Note that a change is over; nodes that it could not start belong to the configuration no more."""
        for name in failed_to_start:
            self._nodes.pop(name, None)
        self._state, self._changed_at = STABLE, now

    def begin_stop(self) -> None:
        """Note that all nodes are being stopped."""
        self._state = CHANGING

    def end_stop(self, now: float) -> None:
        """Note that all nodes have been stopped, and no configuration runs."""
        self._nodes, self._configuration = {}, ""
        self._state, self._changed_at = STABLE, now
        self._deaths.reset()

    def started(self, name: str, now: float) -> None:
        """Note that the process of a node has begun."""
        self._nodes[name] = _Node(self._nodes[name].description, started=now)

    def stopped(self, name: str) -> None:
        """Note that the process of a node has been ended on purpose."""
        if name in self._nodes:
            self._nodes[name] = replace(self._nodes[name], started=None)

    # -- supervision ----------------------------------------------------------------------------------------------

    def to_inspect(self, now: float) -> list[str]:
        """Return the nodes that are old enough for `inspected`, and were not inspected yet."""
        return [
            name
            for name, node in self._nodes.items()
            if node.serves is None and node.started is not None and now - node.started > OFFER_AGE
        ]

    def inspected(self, name: str, advertised: Iterable[str]) -> None:
        """Note the topics and services of a node. A node with none of its own may end when its work is done."""
        own = {offer for offer in advertised if not offer.startswith((f"{name}/get_logg", "/rosout"))}
        self._nodes[name] = replace(self._nodes[name], serves=bool(own - {f"{name}/set_logger_level"}))

    def ended(self, name: str, status: int | None, now: float) -> Ending:
        """Decide what follows from the end of a node's process.

        Args:
            name: of the node.
            status: exit status, negative for a signal.
            now: the time.
        """
        node = self._nodes[name]
        age = now - node.started if node.started is not None else 0.0
        node = self._nodes[name] = replace(node, started=None)
        if status == 0 and not node.serves and not node.description.respawn:
            self._nodes[name] = replace(node, finished=True)
            return Ending(Verdict.FINISHED, f"node {name} has finished, {age:.1f} s after its start")
        how = f"by signal {-status}" if status is not None and status < 0 else f"with status {status}"
        self._message = f"node {name} ended {how}, {age:.1f} s after its start"
        return self._count_death(name, now)

    def failed_to_restart(self, name: str, reason: str, now: float) -> Ending:
        """Decide what follows where a node can't be started again; it counts as one more death."""
        self._message = f"node {name} can't be started again: {reason}"
        return self._count_death(name, now)

    def _count_death(self, name: str, now: float) -> Ending:
        restart_at = self._deaths.count(name, now)
        self._nodes[name] = replace(self._nodes[name], restart_at=restart_at)
        if restart_at is None:
            deaths = f"{self._policy.intensity + 1} deaths in {self._policy.period:g} s"
            self._message = f"{self._message}; {deaths} are too many: {self._configuration} is stopped"
            return Ending(Verdict.GIVE_UP, self._message)
        self._state = RECOVERING
        return Ending(Verdict.RESTART, f"{self._message}: starting it again in {restart_at - now:.1f} s")

    def given_up(self) -> None:
        """Note that the configuration has failed and its nodes have been stopped."""
        self._nodes = {name: replace(node, restart_at=None) for name, node in self._nodes.items()}
        self._state = FAILED

    def next_restart(self) -> float | None:
        """Return the time of the next restart; None where no node waits for one."""
        return min((node.restart_at for node in self._nodes.values() if node.restart_at is not None), default=None)

    def to_restart(self, now: float) -> list[str]:
        """Return the nodes whose restart is due."""
        return [name for name, node in self._nodes.items() if node.restart_at is not None and node.restart_at <= now]

    def recovered(self) -> bool:
        """Become STABLE where all nodes run again; return whether that is so."""
        if self._state != RECOVERING or self.report().dead:
            return False
        self._state = STABLE
        return True

    # -- standby --------------------------------------------------------------------------------------------------

    def may_stand_by(self, now: float) -> bool:
        """Tell whether warm processes may be started: not during a change, and not right after one."""
        return self._state == STABLE and now - self._changed_at > STANDBY_DELAY


def standby_changes(wanted: Collection[Kind], warm: Mapping[Kind, bool]) -> tuple[list[Kind], list[Kind]]:
    """Decide which warm processes to close and which to start, so that there is one of each wanted kind.

    Args:
        wanted: the kinds of the nodes that run.
        warm: for each kind of which there is a warm process, whether that process still runs.

    Returns:
        The kinds of which to close the process, and the kinds of which to start one.
    """
    closed = [kind for kind, runs in warm.items() if kind not in wanted or not runs]
    kept = set(warm) - set(closed)
    return closed, [kind for kind in wanted if kind not in kept]
