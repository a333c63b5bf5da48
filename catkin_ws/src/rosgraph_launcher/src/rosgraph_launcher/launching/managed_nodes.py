"""The nodes of the functions that run: which to stop, keep and start, and what follows when one ends.

A node runs once, however many functions share it. Times are arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.contested import ANSWER_TIMEOUT, ContestedNames
from rosgraph_launcher.launching.nodelets import loaders
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport
from rosgraph_launcher.launching.restarts import DeathCounter, Ending, Meaning, RestartPolicy, Verdict, meaning_of_end

OFFER_AGE = 1.0  # s after a node's start: by then most nodes have advertised their topics and services
LONGEST_GAP = 30.0  # s between two looks at a node that has advertised none; each look is one call of the master
STANDBY_DELAY = 0.5  # s after a change: the imports of a warm process must not slow the new nodes down


@dataclass(frozen=True)
class _Node:
    """A node that should run.

    Attributes:
        description: how it is started.
        started: when its process began; None: it has no process.
        restart_at: when it is started again; None: it is not due.
        inspect_at: when somebody looks next whether it has topics or services of its own, unless they are known.
        serves: whether it has any, as far as is known.
        finished: whether it has done its work and ended.
        has_died: whether its last process ended by itself.
    """

    description: NodeDescription
    started: float | None = None
    restart_at: float | None = None
    inspect_at: float = 0.0
    serves: bool = False
    finished: bool = False
    has_died: bool = False

    @property
    def is_available(self) -> bool:
        """Whether it runs, is about to run again, or has done its work."""
        return self.started is not None or self.restart_at is not None or self.finished


@dataclass(frozen=True)
class _Function:
    """A function that has nodes.

    Attributes:
        deaths: counts those of its nodes.
        configuration: the one that runs; empty: none.
        change: number of its last change.
        nodes: names of its nodes.
        state: STABLE, CHANGING, RECOVERING or FAILED.
        message: how its last node ended; empty where none did.
        changed_at: when its last change ended.
    """

    deaths: DeathCounter
    configuration: str = ""
    change: int = 0
    nodes: tuple[str, ...] = ()
    state: str = STABLE
    message: str = ""
    changed_at: float = float("-inf")


class ManagedNodes:
    """The nodes of all functions, and the state of each function that the launcher reports."""

    def __init__(self, policy: RestartPolicy) -> None:
        self._policy = policy
        self._nodes: dict[str, _Node] = {}
        self._functions: dict[str, _Function] = {}
        self._contested = ContestedNames()
        self._changes = 0

    # -- what runs ------------------------------------------------------------------------------------------------

    @property
    def changes(self) -> int:
        """Number of the changes that were asked for."""
        return self._changes

    @property
    def names(self) -> tuple[str, ...]:
        """All nodes of all functions, also those that have done their work."""
        return tuple(self._nodes)

    def runs(self, name: str) -> bool:
        """Tell whether a node has a process."""
        return name in self._nodes and self._nodes[name].started is not None

    @property
    def needed(self) -> tuple[str, ...]:
        """The nodes that run or should run."""
        return tuple(name for name, node in self._nodes.items() if not node.finished and self._needing(name))

    def description(self, name: str) -> NodeDescription:
        """Return how a node is started."""
        return self._nodes[name].description

    def find(self, name: str) -> NodeDescription | None:
        """Return how a node is started; None: the launcher has no such node."""
        node = self._nodes.get(name)
        return node.description if node else None

    def reports(self) -> tuple[LauncherReport, ...]:
        """Return what the launcher tells of each function."""
        return tuple(self.report(name) for name in self._functions)

    def report(self, name: str) -> LauncherReport:
        """Return what the launcher tells of one function."""
        function = self._functions[name]
        unfinished = [node for node in function.nodes if not self._nodes[node].finished]
        dead = tuple(node for node in unfinished if self._nodes[node].started is None)
        return LauncherReport(
            name,
            function.configuration,
            function.change,
            function.state,
            tuple(unfinished),
            dead,
            function.message,
        )

    # -- changes --------------------------------------------------------------------------------------------------

    def ask_for_change(self, name: str) -> None:
        """Count a change of a function that was asked for."""
        self._changes += 1
        self._set(name, change=self._changes)

    def refusal(self, nodes: Mapping[str, NodeDescription], start: Collection[str]) -> str:
        """Return why a change can't be made; empty where it can.

        A change may have been planned for a launcher that died since and that had more nodes.

        Args:
            nodes: all nodes of the wanted configuration.
            start: the nodes to start.
        """
        unknown = [name for name in start if name not in nodes]
        if unknown:
            return f"starts no node {', '.join(unknown)}"
        available = {name for name, node in self._nodes.items() if node.is_available}
        lacking = [name for name in nodes if name not in start and name not in available]
        return f"needs {', '.join(lacking)}, which does not run: start it, too" if lacking else ""

    def begin_change(self, name: str, stop: Collection[str], start: Collection[str]) -> list[str]:
        """Begin a change of a function, and return the nodes that must end.

        Those are the nodes in `start` that run, and those of the function in `stop` that no other function shares.
        """
        function = self._set(name, state=CHANGING, message="")
        own = [node for node in function.nodes if node in stop and not self._sharers(node, name)]
        return [node for node in self._nodes if node in start or node in own]

    def adopt(
        self,
        name: str,
        configuration: str,
        nodes: Mapping[str, NodeDescription],
        stop: Collection[str],
        start: Collection[str],
        now: float = 0.0,
        taken: Mapping[str, str] | None = None,
    ) -> None:
        """Note that a function has the nodes of a configuration.

        Those are the ones in `start`, and those that ran before and are kept. A node that the configuration lacks and
        that is not in `stop` stays until a later change stops it, unless it has done its work. In `taken` are the nodes
        whose names somebody else had when the change began, with who that was.
        """
        function = self._functions[name]
        if configuration != function.configuration:
            function.deaths.reset()
        left = [n for n in function.nodes if n not in nodes and n not in stop and not self._nodes[n].finished]
        kept = [node for node in nodes if node not in start and node in self._nodes]
        for node in start:
            self._contested.begin(node, (taken or {}).get(node, ""), now)
            self._nodes[node] = _Node(nodes[node], serves=self._has_served(nodes[node]))
        for node in kept:
            self._nodes[node] = replace(self._nodes[node], description=nodes[node])
        names = tuple([node for node in nodes if node in start or node in kept] + left)
        self._set(name, configuration=configuration, message="", nodes=names)
        self._drop_unneeded()

    def end_change(self, name: str, now: float, failed_to_start: Iterable[str] = ()) -> None:
        """Note that a change is over; nodes that it could not start belong to no configuration any more."""
        failed = set(failed_to_start)
        for node in failed:
            for other in self._sharers(node, name):  # it was restarted, and the other function still needs it
                self._nodes[node] = replace(self._nodes[node], restart_at=now)
                self._set(other, state=RECOVERING, message=f"node {node} could not be restarted for {name}")
        own = tuple(node for node in self._functions[name].nodes if node not in failed)
        self._set(name, nodes=own, state=STABLE, changed_at=now)
        self._drop_unneeded()

    def begin_release(self, name: str) -> list[str]:
        """Begin to release a function, and return the nodes that must end: those that no other function shares."""
        function = self._set(name, state=CHANGING, message="")
        return [node for node in function.nodes if not self._sharers(node, name)]

    def end_release(self, name: str, now: float) -> None:
        """Note that a function has no nodes any more."""
        self._functions[name].deaths.reset()
        self._set(name, configuration="", nodes=(), state=STABLE, message="", changed_at=now)
        self._drop_unneeded()

    def started(self, name: str, now: float) -> None:
        """Note that the process of a node has begun."""
        node = self._nodes[name]
        self._nodes[name] = _Node(node.description, started=now, inspect_at=now + OFFER_AGE, serves=node.serves)

    def stopped(self, name: str) -> None:
        """Note that the process of a node has been ended on purpose."""
        if name in self._nodes:
            self._nodes[name] = replace(self._nodes[name], started=None)

    def has_died(self, name: str) -> bool:
        """Tell whether the last process of a node ended by itself."""
        return self._nodes[name].has_died

    # -- supervision ----------------------------------------------------------------------------------------------

    def to_inspect(self, now: float) -> list[str]:
        """Return the nodes that are due for `inspected`.

        A node that imports or calibrates for long advertises late. So a node with nothing of its own is looked at again
        and again: first at twice its age, later every LONGEST_GAP.
        """
        return [
            name
            for name, node in self._nodes.items()
            if not node.serves and node.started is not None and now >= node.inspect_at
        ]

    def inspected(self, name: str, advertised: Iterable[str], now: float) -> None:
        """Note the topics and services of a node. A node that never had any of its own may end when its work is done.

        Args:
            name: of the node.
            advertised: the topics and services that it has now.
            now: the time.
        """
        node = self._nodes[name]
        own = {offer for offer in advertised if not offer.startswith((f"{name}/get_logg", "/rosout"))}
        serves = node.serves or bool(own - {f"{name}/set_logger_level"})
        age = now - node.started if node.started is not None else 0.0
        self._nodes[name] = replace(node, serves=serves, inspect_at=now + min(max(age, OFFER_AGE), LONGEST_GAP))

    def ended(self, name: str, status: int | None, now: float, conflict: str = "") -> Ending:
        """Decide what follows from the end of a node's process.

        Args:
            name: of the node.
            status: exit status, negative for a signal.
            now: the time.
            conflict: who has taken the node's name, with the remedy; empty: nobody is known to have.
        """
        if status == 0:  # who takes a name again and again may be busy to end or to start
            conflict = conflict or self._contested.conflict(name)
        if conflict:
            self._contested.taken(name, conflict, now)
        node = self._nodes[name]
        age = now - node.started if node.started is not None else 0.0
        node = self._nodes[name] = replace(node, started=None, has_died=True)
        meaning = meaning_of_end(node.description, status, node.serves, bool(conflict))
        if meaning is Meaning.FINISHED:
            self._nodes[name] = replace(node, finished=True)
            return Ending(Verdict.FINISHED, f"node {name} has finished, {age:.1f} s after its start")
        how = f"by signal {-status}" if status is not None and status < 0 else f"with status {status}"
        message = f"node {name} ended {how}, {age:.1f} s after its start{conflict and f': {conflict}'}"
        if meaning is Meaning.FAILURE:
            return self._give_up(self._needing(name), message, "it is required")
        if meaning is Meaning.TURN:
            restart_at = now + max(node.description.respawn_delay, self._policy.first_delay)
            self._nodes[name] = replace(node, restart_at=restart_at)
            return Ending(Verdict.RESTART, f"{message}: starting it again in {restart_at - now:.1f} s")
        return self._count_death(name, message, now)

    def failed_to_restart(self, name: str, reason: str, now: float) -> Ending:
        """Decide what follows where a node can't be started again; it counts as one more death."""
        return self._count_death(name, f"node {name} can't be started again: {reason}", now)

    def hung(self, name: str, now: float) -> Ending:
        """Decide what follows where a node did not answer under its contested name, and was ended.

        This takes longer than the period in which deaths are counted, so the times in a row are counted, too.
        """
        message = f"node {name} has not answered under its name within {ANSWER_TIMEOUT:g} s"
        times = self._contested.hung(name)
        if times > self._policy.intensity:
            return self._give_up(self._needing(name), message, f"{times} times in a row are too many")
        return self._count_death(name, message, now)

    def _count_death(self, name: str, message: str, now: float) -> Ending:
        """Count a death for each function of the node: a function may give up while another one goes on."""
        restarts, given_up = [], []
        for owner in self._needing(name):
            restart_at = self._functions[owner].deaths.count(name, now)
            if restart_at is None:
                given_up.append(owner)
            else:
                restarts.append(max(restart_at, now + self._nodes[name].description.respawn_delay))
                self._set(owner, state=RECOVERING, message=message)
        restart_at = max(restarts, default=None)
        self._nodes[name] = replace(self._nodes[name], restart_at=restart_at)
        if not given_up:
            delay = 0.0 if restart_at is None else restart_at - now
            with_it = self._restart_loaders(name, restart_at)
            its = f" with {', '.join(with_it)}" if with_it else ""
            return Ending(Verdict.RESTART, f"{message}: starting it again{its} in {delay:.1f} s", with_it)
        deaths = f"{self._policy.intensity + 1} deaths in {self._policy.period:g} s are too many"
        return self._give_up(given_up, message, deaths)

    def _restart_loaders(self, manager: str, restart_at: float | None) -> tuple[str, ...]:
        """Have the nodes started again whose nodelets have ended with their manager, and return them."""
        described = {name: node.description for name, node in self._nodes.items() if node.started is not None}
        with_it = tuple(loaders(described, [manager]))
        for name in with_it:
            self._nodes[name] = replace(self._nodes[name], restart_at=restart_at)
        return with_it

    def _give_up(self, given_up: list[str], message: str, reason: str) -> Ending:
        """Fail functions, and return which of their nodes no other function needs."""
        stopped: list[str] = []
        for owner in given_up:
            text = f"{message}; {reason}: {self._functions[owner].configuration} is stopped"
            self._set(owner, state=FAILED, message=text)
        for owner in given_up:
            stopped += [n for n in self._functions[owner].nodes if n not in stopped and not self._needing(n)]
        for node in stopped:
            self._contested.forget(node)
            self._nodes[node] = replace(self._nodes[node], restart_at=None)
        names = " and ".join(self._functions[owner].configuration for owner in given_up)
        return Ending(Verdict.GIVE_UP, f"{message}; {reason}: {names} is stopped", tuple(stopped))

    def next_restart(self) -> float | None:
        """Return the time of the next restart; None where no node waits for one."""
        return min((node.restart_at for node in self._nodes.values() if node.restart_at is not None), default=None)

    def to_restart(self, now: float) -> list[str]:
        """Return the nodes whose restart is due."""
        return [name for name, node in self._nodes.items() if node.restart_at is not None and node.restart_at <= now]

    @property
    def contested(self) -> dict[str, str]:
        """The nodes that run, and whose names somebody else had taken a short while ago, with who that was."""
        return {name: self._contested.conflict(name) for name in self._contested.names if self.runs(name)}

    def seen(self, name: str, is_own: bool, now: float) -> None:
        """Note whether the launcher's own process answers under a contested name."""
        self._contested.seen(name, is_own, now)

    def hanging(self, now: float) -> list[str]:
        """Return the nodes that have run for long and do not answer under their contested names."""
        return [
            name
            for name in self.contested
            if not self._contested.is_held(name) and now - (self._nodes[name].started or now) > ANSWER_TIMEOUT
        ]

    def recovered(self) -> bool:
        """Make each function STABLE whose nodes all run again under their own names; return whether there is one."""
        contested = set(self._contested.names)
        recovering = [name for name, function in self._functions.items() if function.state == RECOVERING]
        names = [n for n in recovering if not self.report(n).dead and contested.isdisjoint(self._functions[n].nodes)]
        for name in names:
            self._set(name, state=STABLE)
        return bool(names)

    # -- standby --------------------------------------------------------------------------------------------------

    def may_stand_by(self, now: float) -> bool:
        """Tell whether a warm process may be started: not during a change, and not right after one."""
        functions = self._functions.values()
        busy = any(f.state in (CHANGING, RECOVERING) or now - f.changed_at <= STANDBY_DELAY for f in functions)
        return any(f.state == STABLE for f in functions) and not busy

    # -- helpers --------------------------------------------------------------------------------------------------

    def _set(self, name: str, **changes: object) -> _Function:
        function = self._functions.get(name) or _Function(DeathCounter(self._policy))
        self._functions[name] = function = replace(function, **changes)  # type: ignore[arg-type]
        return function

    def _owners(self, node: str) -> list[str]:
        return [name for name, function in self._functions.items() if node in function.nodes]

    def _needing(self, node: str) -> list[str]:
        """Return the functions that have a node and were not given up."""
        return [name for name in self._owners(node) if self._functions[name].state != FAILED]

    def _sharers(self, node: str, name: str) -> list[str]:
        """Return the functions other than `name` that need a node."""
        return [other for other in self._needing(node) if other != name]

    def _has_served(self, description: NodeDescription) -> bool:
        """Tell whether a node that is started anew is known to have had topics or services before."""
        before = self._nodes.get(description.name)
        if before is None or not before.serves:
            return False
        same = (before.description.executable, before.description.args)
        return same == (description.executable, description.args)

    def _drop_unneeded(self) -> None:
        """Forget nodes that no function has any more, and restarts of those that only failed functions have."""
        owned = {name: node for name, node in self._nodes.items() if self._owners(name)}
        self._nodes = {n: node if self._needing(n) else replace(node, restart_at=None) for n, node in owned.items()}
        self._contested.keep(self._nodes)
