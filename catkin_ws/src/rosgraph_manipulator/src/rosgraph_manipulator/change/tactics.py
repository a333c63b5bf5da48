"""Tactics: ways to change the running configuration into the wanted one, as plans that can be printed first.

`plan_change` takes two descriptions and returns the plans, cheapest first.

A tactic is a function `(Difference, RunningNodes) -> Plan | None`. It returns None where it has no way. A package
offers another tactic in its package.xml:
`<export><rosgraph_manipulator tactic="NAME" function="MODULE:FUNCTION"/></export>`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from dataclasses import replace as with_changes
from typing import Any, Protocol

from node_kit.plugins import find
from rosgraph_launcher.description import SystemDescription
from rosgraph_launcher.launching.nodelets import loaders

from rosgraph_manipulator.configuration.difference import Difference, compare

PACKAGE = "rosgraph_manipulator"

PARAMETERS_COST, RESTART_COST, REPLACE_COST = 0.05, 0.6, 1.2
"""Seconds by which plans are compared, measured with D2's move_base (tests/bench/reconfigure_*.py). A plan counts one
restart, however many nodes it starts: they start side by side."""


@dataclass(frozen=True)
class Adjustable:
    """One parameter that a running node takes by dynamic_reconfigure.

    Attributes:
        server: namespace of the dynamic_reconfigure server, e.g. `/move_base/local_costmap`.
        name: name of the parameter at this server.
        kind: `bool`, `int`, `double` or `str`.
        low: least value of an int or double.
        high: largest value of an int or double.
    """

    server: str
    name: str
    kind: str
    low: float = float("-inf")
    high: float = float("inf")

    def takes(self, value: Any) -> bool:
        """Tell whether a value has the right type and is within the bounds."""
        if self.kind == "str":
            return isinstance(value, str)
        if self.kind == "bool" or isinstance(value, bool):
            return self.kind == "bool" and isinstance(value, bool)
        whole = isinstance(value, int) or (isinstance(value, float) and self.kind == "double")
        return whole and self.low <= value <= self.high


class RunningNodes(Protocol):
    """What a tactic can ask of the nodes that run."""

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:
        """Return what a node takes by dynamic_reconfigure, by the parameter's name relative to the node's."""


class NoRunningNodes:
    """The answer where no node can be asked: none takes any parameter while it runs."""

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:  # noqa: ARG002
        """Return no parameter."""
        return {}


class StepExecutor(Protocol):
    """What carries out the steps of a plan. Each call blocks until the step is done, or raises DeploymentError."""

    def set_parameters(self, server: str, values: Mapping[str, Any]) -> None:
        """Set values at a dynamic_reconfigure server."""

    def change_processes(self, stop: tuple[str, ...], start: tuple[str, ...]) -> None:
        """Set the wanted configuration's parameters, stop nodes, wait until they have ended, and start nodes."""


class Step(Protocol):
    """One step of a plan; its text says what it does."""

    def run(self, executor: StepExecutor) -> None:
        """Carry out the step."""


@dataclass(frozen=True)
class SetParameters:
    """Set parameters at a dynamic_reconfigure server, while its node runs."""

    server: str
    values: Mapping[str, Any]

    def run(self, executor: StepExecutor) -> None:
        """Carry out the step."""
        executor.set_parameters(self.server, self.values)

    def __str__(self) -> str:
        """Return what the step does."""
        return f"set at {self.server}: {', '.join(f'{name} = {value}' for name, value in self.values.items())}"


@dataclass(frozen=True)
class ChangeProcesses:
    """Set the configuration's parameters, and have the launcher stop nodes and start nodes.

    A node in both tuples is restarted. Without nodes, the launcher only notes which configuration runs. A plan may have
    several such steps, for example to start new nodes before it stops the old ones.
    """

    stop: tuple[str, ...] = ()
    start: tuple[str, ...] = ()

    def run(self, executor: StepExecutor) -> None:
        """Carry out the step."""
        executor.change_processes(self.stop, self.start)

    def __str__(self) -> str:
        """Return what the step does."""
        restart = [name for name in self.stop if name in self.start]
        parts = [
            ("stop", [name for name in self.stop if name not in self.start]),
            ("restart", restart),
            ("start", [name for name in self.start if name not in self.stop]),
        ]
        done = [f"{word} {', '.join(names)}" for word, names in parts if names]
        return "; ".join([*done, "store the configuration's parameters"])


@dataclass(frozen=True)
class Plan:
    """A way to the wanted configuration.

    Attributes:
        tactic: name of the tactic that made it.
        cost: estimate of the time for which the function is missing, s.
        steps: what to do, in this order.
    """

    tactic: str
    cost: float
    steps: tuple[Step, ...]

    @property
    def touched(self) -> tuple[str, ...]:
        """The nodes that are started or stopped."""
        return tuple(
            name for step in self.steps if isinstance(step, ChangeProcesses) for name in (*step.stop, *step.start)
        )

    @property
    def started(self) -> tuple[str, ...]:
        """The nodes that are started."""
        return tuple(name for step in self.steps if isinstance(step, ChangeProcesses) for name in step.start)

    def __str__(self) -> str:
        """Return the plan with one line for each step."""
        return "\n".join([self.tactic, *(f"  {number}. {step}" for number, step in enumerate(self.steps, 1))])


Tactic = Callable[[Difference, RunningNodes], Plan | None]


def nothing(difference: Difference, _nodes: RunningNodes) -> Plan | None:
    """Leave all nodes alone, where none differs and no parameter has drifted."""
    return None if difference.touches_nodes or difference.drifted else Plan("nothing", 0.0, (ChangeProcesses(),))


def parameters(difference: Difference, nodes: RunningNodes) -> Plan | None:
    """Set parameters where only parameters differ: by dynamic_reconfigure those that nodes take while they run."""
    if difference.starts or difference.stops or difference.replaced:
        return None
    if not (difference.parameters or difference.drifted):
        return None
    steps: list[Step] = []
    for node, values in difference.parameters.items():
        taken = _calls_to_set(values, nodes.adjustable(node))
        if taken is None:
            return None
        steps += taken
    return Plan("parameters", PARAMETERS_COST, (*steps, ChangeProcesses()))  # which stores all of them


def restart(difference: Difference, nodes: RunningNodes) -> Plan | None:
    """Restart only the nodes that differ; a node that takes its parameters by dynamic_reconfigure runs on."""
    restarts = list(difference.replaced)
    steps: list[Step] = []
    for node, values in difference.parameters.items():
        taken = _calls_to_set(values, nodes.adjustable(node)) if difference.replaced or difference.starts else None
        if taken is None:
            restarts.append(node)
        else:
            steps += taken
    if not (difference.touches_nodes and difference.running.nodes):
        return None
    start = tuple(node for node in difference.wanted.nodes if node in restarts or node in difference.starts)
    return Plan("restart", RESTART_COST, (*steps, ChangeProcesses((*difference.stops, *restarts), start)))


def replace(difference: Difference, _nodes: RunningNodes) -> Plan | None:
    """Stop all running nodes and start all wanted ones, which is always possible; shared nodes run on."""
    stop, start = (
        tuple(name for name in system.nodes if name not in difference.shared_nodes)
        for system in (difference.running, difference.wanted)
    )
    return Plan("replace", REPLACE_COST, (ChangeProcesses(stop, start),))


def plan_change(
    running: SystemDescription,
    wanted: SystemDescription,
    nodes: RunningNodes,
    tactics: Mapping[str, Tactic],
    shared_nodes: Collection[str] = (),
    drifted: Collection[str] = (),
) -> tuple[list[Plan], list[str]]:
    """Return the plans that change one configuration into another, cheapest first.

    A plan with the same steps as a cheaper one is left out. Where parameters have drifted that no node takes while it
    runs, and nothing else differs, no node is touched. A tactic that raises does not keep the others from
    planning. Each plan ends with a step that stops the nodes that the wanted configuration lacks, where no earlier step
    of it does. A step that starts a nodelet's manager also restarts the nodes whose nodelets it has.

    Args:
        running: the configuration that runs.
        wanted: the configuration to deploy.
        nodes: answers what running nodes take by dynamic_reconfigure.
        tactics: the tactics to ask, by name.
        shared_nodes: nodes that another function needs; they run on.
        drifted: parameters of the configuration, which runs already, that somebody has changed since.

    Returns:
        The plans, and a line for each tactic that raised.
    """
    difference = compare(running, wanted, shared_nodes, drifted)
    proposed, problems = [], []
    for name, tactic in tactics.items():
        try:
            plan = tactic(difference, nodes)
        except (Exception, SystemExit) as error:  # the code of a plug-in is not ours: the other tactics still plan
            problems.append(f"tactic {name} makes no plan: {type(error).__name__}: {error}")
        else:
            proposed += [_completed(_with_nodelets(plan, difference), difference)] if plan else []
    kept: list[Plan] = []
    is_light = bool(difference.drifted) and not difference.touches_nodes
    for plan in sorted(proposed, key=lambda plan: plan.cost):
        if is_light and plan.touched:
            continue
        if plan.steps not in [other.steps for other in kept]:
            kept.append(plan)
    return kept, problems


def _completed(plan: Plan, difference: Difference) -> Plan:
    """Return a plan whose last step also stores the configuration and stops what no other step stops."""
    left = tuple(name for name in difference.stops if name not in plan.touched)
    if not left and plan.steps and isinstance(plan.steps[-1], ChangeProcesses):
        return plan
    return with_changes(plan, steps=(*plan.steps, ChangeProcesses(stop=left)))


def _with_nodelets(plan: Plan, difference: Difference) -> Plan:
    """Return a plan that restarts the nodes whose nodelets end with a manager that it restarts."""
    kept = {name: node for name, node in difference.wanted.nodes.items() if name not in plan.touched}

    def completed(step: Step) -> Step:
        if not isinstance(step, ChangeProcesses):
            return step
        left = tuple(loaders(kept, step.start))
        return ChangeProcesses((*step.stop, *left), (*step.start, *left))

    return with_changes(plan, steps=tuple(map(completed, plan.steps)))


def load_tactics() -> dict[str, Tactic]:
    """Return the tactics that packages export, by name.

    Raises:
        PluginError: an export can't be used.
    """
    return {name: plugin.load() for name, plugin in find(PACKAGE, "tactic").items()}


def _calls_to_set(values: Mapping[str, Any], adjustable: Mapping[str, Adjustable]) -> list[SetParameters] | None:
    """Return the calls that set all values, one per server; None where one can't be set."""
    by_server: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        found = adjustable.get(key)
        if found is None or not found.takes(value):
            return None
        by_server.setdefault(found.server, {})[found.name] = float(value) if found.kind == "double" else value
    return [SetParameters(server, taken) for server, taken in by_server.items()]
