"""What always holds, and what holds again some time after the last fault."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from metacontrol_msgs.msg import FunctionGrounding
from rosgraph_launcher.launching.report import CHANGING, RECOVERING

from simulated.alarms import Alarms
from simulated.launcher import LauncherPart
from simulated.world import World

SETTLED = 2.0  # s, without any disturbance and with nothing under way
ENDS = ("rejected", "succeeded", "aborted", "canceled")


class Invariants:
    """Looks at a world after each step; each thing that is broken is told once."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._alarms = Alarms(world)
        self._next_look = 0.0
        self._quiet_since: float | None = None

    def look(self) -> None:
        """Look, and add what is broken to the world's list."""
        world = self._world
        self._see_goals()
        if world.kernel.now >= self._next_look:
            self._next_look = world.kernel.now + 0.05
            self._see_roles()
            world.broken += self._alarms.missing()
            world.broken += self._alarms.withdrawn()
            if self.is_quiet():
                world.broken += list(disagreements(world))

    def is_quiet(self) -> bool:
        """Tell whether nothing has been under way for a while, and nothing has disturbed it."""
        world = self._world
        now = world.kernel.now
        if not _rests(world):
            self._quiet_since = None
        elif self._quiet_since is None:
            self._quiet_since = now
        since = self._quiet_since
        return since is not None and now - max(since, world.disturbed) > SETTLED

    def _see_roles(self) -> None:
        """No two processes of one role run, as far as launchers have started them."""
        names = Counter(p.name for p in self._world.host.living() if isinstance(p.owner, LauncherPart))
        for name, count in names.items():
            if count > 1:
                self._world.broken.append(f"{count} processes of node {name}, started by launchers, run at once")

    def _see_goals(self) -> None:
        """A goal is acknowledged once, and ends once."""
        for goal in self._world.goals.all[-20:]:
            if goal.told.count("accepted") > 1 or sum(goal.told.count(end) for end in ENDS) > 1:
                self._world.broken.append(f"the goal for {goal.wanted} was told {goal.told}")
                goal.told.clear()


def _rests(world: World) -> bool:
    launcher, manipulator = world.launcher, world.manipulator
    if launcher is None or manipulator is None or launcher.process.frozen or manipulator.process.frozen:
        return False
    at_work = any(report.state in (CHANGING, RECOVERING) for report in launcher.reports)
    return launcher.is_idle and manipulator.is_idle and manipulator.heard is launcher.reports and not at_work


def disagreements(world: World) -> Iterator[str]:
    """Yield how the active configuration differs from the processes, where nothing is under way."""
    manipulator = world.manipulator
    if manipulator is None:
        return
    running = {p.name for p in world.host.living() if isinstance(p.owner, LauncherPart)}
    wanted: set[str] = set()
    for told in manipulator.told.values():
        nodes = set(world.system.described[told.configuration].nodes)
        if told.state == FunctionGrounding.STABLE:
            wanted |= nodes
            if nodes - running:
                lacking = ", ".join(sorted(nodes - running))
                yield f"{told.configuration} is STABLE, and these of its nodes do not run: {lacking}"
        elif told.state != FunctionGrounding.FAILED:
            yield f"{told.configuration} stays {told.state}, and nothing is under way"
    if running - wanted:
        yield f"no active configuration needs these nodes, which run: {', '.join(sorted(running - wanted))}"


def unfulfilled(world: World) -> list[str]:
    """Return what keeps the system from being as it should be: each objective STABLE on a realisable variant."""
    found: list[str] = []
    told = dict(world.manipulator.told) if world.manipulator else {}
    functions = [objective.function for objective in world.system.objectives]
    while functions:
        function = functions.pop()
        if not realisable(world, function):
            continue
        active = told.get(function)
        if active is None or active.state != FunctionGrounding.STABLE:
            found.append(f"{function} is {active.state if active else 'not deployed'}")
        elif active.configuration not in realisable(world, function):
            found.append(f"{function} runs {active.configuration}, which is not realisable")
        else:
            hang = [node for node in world.system.described[active.configuration].nodes if not _works(world, node)]
            found += [f"node {node} of {active.configuration} does not answer" for node in hang]
            functions += world.system.knowledge.designs[active.configuration].requires
    return found


def realisable(world: World, function: str) -> list[str]:
    """Return the designs of a function whose components work, and whose required functions have such designs."""
    knowledge = world.system.knowledge
    node_of = {component: node for node, component in world.system.components.items()}
    base = world.system.base_nodes

    def works(component: str) -> bool:
        node = f"{world.system.namespace}{node_of.get(component, component)}"
        return node not in base or _works(world, node)

    return [
        design.name
        for design in knowledge.designs.values()
        if design.function == function
        and all(works(component) for component in design.components)
        and all(realisable(world, required) for required in design.requires)
    ]


def _works(world: World, node: str) -> bool:
    return world.host.answering(node) is not None
