"""Tactics: ways from the running to the wanted configuration, as plans that can be printed before anything is touched.

A tactic is a function `(Difference, Facts) -> Plan | None`; None: it can't get there. Packages offer more of them by
`<export><rosgraph_manipulator tactic="NAME" function="MODULE:FUNCTION"/></export>` in their package.xml.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from node_kit.plugins import exported

from rosgraph_manipulator.configuration.description import Difference

PACKAGE = "rosgraph_manipulator"

PARAMETERS_COST, RESTART_COST, REPLACE_COST = 0.05, 0.6, 1.2
"""Seconds, to compare plans by: measured with D2's move_base (tests/bench/reconfigure_*.py); a restart counts once,
since nodes start side by side."""


class TacticError(Exception):
    """A tactic plug-in can't be used; the message names the package."""


@dataclass(frozen=True)
class Adjustable:
    """One parameter that a running node takes by dynamic_reconfigure.

    Attributes:
        server: namespace of the server, below which `set_parameters` is.
        name: of the parameter at this server.
        kind: `bool`, `int`, `double` or `str`.
        low: least value of an int or double.
        high: largest one.
    """

    server: str
    name: str
    kind: str
    low: float = float("-inf")
    high: float = float("inf")

    def takes(self, value: Any) -> bool:
        """Whether a value has the right type and is within the bounds."""
        if self.kind == "str":
            return isinstance(value, str)
        if self.kind == "bool" or isinstance(value, bool):
            return self.kind == "bool" and isinstance(value, bool)
        whole = isinstance(value, int) or (isinstance(value, float) and self.kind == "double")
        return whole and self.low <= value <= self.high


class Facts(Protocol):
    """What can be asked of the running system."""

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:
        """Return what a node takes by dynamic_reconfigure, by the parameter's name relative to the node's."""


class Platform(Protocol):
    """What steps are carried out with. Every call blocks until done, and raises DeploymentError."""

    def set_parameters(self, server: str, values: Mapping[str, Any]) -> None:
        """Have a dynamic_reconfigure server take values."""

    def change_processes(self, stop: tuple[str, ...], start: tuple[str, ...]) -> None:
        """Set the wanted configuration's parameters, stop nodes, wait until they are gone, start nodes."""


class Step(Protocol):
    """One thing to do; its text says what."""

    def run(self, platform: Platform) -> None:
        """Do it."""


@dataclass(frozen=True)
class SetParameters:
    """A dynamic_reconfigure server takes values, by name."""

    server: str
    values: Mapping[str, Any]

    def run(self, platform: Platform) -> None:
        """Do it."""
        platform.set_parameters(self.server, self.values)

    def __str__(self) -> str:
        """Return what is done."""
        return f"set at {self.server}: {', '.join(f'{name} = {value}' for name, value in self.values.items())}"


@dataclass(frozen=True)
class ChangeProcesses:
    """The launcher sets the parameters, stops nodes and starts nodes; with none, it takes note of the configuration."""

    stop: tuple[str, ...] = ()
    start: tuple[str, ...] = ()

    def run(self, platform: Platform) -> None:
        """Do it."""
        platform.change_processes(self.stop, self.start)

    def __str__(self) -> str:
        """Return what is done."""
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
    """A way to the wanted configuration: the tactic's name, its cost (s without the function, about), its steps."""

    tactic: str
    cost: float
    steps: tuple[Step, ...]

    @property
    def touched(self) -> tuple[str, ...]:
        """Nodes that are started or stopped."""
        return tuple(
            name for step in self.steps if isinstance(step, ChangeProcesses) for name in (*step.stop, *step.start)
        )

    @property
    def started(self) -> tuple[str, ...]:
        """Nodes that are started."""
        return tuple(name for step in self.steps if isinstance(step, ChangeProcesses) for name in step.start)

    def __str__(self) -> str:
        """Return the plan, a line per step."""
        return "\n".join([self.tactic, *(f"  {number}. {step}" for number, step in enumerate(self.steps, 1))])


Tactic = Callable[[Difference, Facts], Plan | None]


def nothing(difference: Difference, _facts: Facts) -> Plan | None:
    """Leave the nodes alone, where none differs."""
    return None if difference.touches_nodes else Plan("nothing", 0.0, (ChangeProcesses(),))


def parameters(difference: Difference, facts: Facts) -> Plan | None:
    """Have the running nodes take their parameters by dynamic_reconfigure, where only parameters differ."""
    if difference.starts or difference.stops or difference.replaced or not difference.parameters:
        return None
    steps: list[Step] = []
    for node, values in difference.parameters.items():
        taken = _settings(values, facts.adjustable(node))
        if taken is None:
            return None
        steps += taken
    return Plan("parameters", PARAMETERS_COST, (*steps, ChangeProcesses()))


def restart(difference: Difference, facts: Facts) -> Plan | None:
    """Restart exactly the nodes that differ; those that take their parameters while they run go on."""
    restarts = list(difference.replaced)
    steps: list[Step] = []
    for node, values in difference.parameters.items():
        taken = _settings(values, facts.adjustable(node)) if difference.replaced or difference.starts else None
        if taken is None:
            restarts.append(node)
        else:
            steps += taken
    if not (difference.touches_nodes and difference.running.nodes):
        return None
    start = tuple(node for node in difference.wanted.nodes if node in restarts or node in difference.starts)
    return Plan("restart", RESTART_COST, (*steps, ChangeProcesses((*difference.stops, *restarts), start)))


def replace(difference: Difference, _facts: Facts) -> Plan | None:
    """Stop everything that runs, start everything that is wanted: this is always possible."""
    return Plan(
        "replace", REPLACE_COST, (ChangeProcesses(tuple(difference.running.nodes), tuple(difference.wanted.nodes)),)
    )


def plans(difference: Difference, facts: Facts, tactics: Mapping[str, Tactic]) -> tuple[list[Plan], list[str]]:
    """Return what the tactics propose, cheapest first; what does the same as a cheaper plan is left out.

    Returns:
        The plans, and which tactics failed and why.
    """
    proposed, problems = [], []
    for name, tactic in tactics.items():
        try:
            plan = tactic(difference, facts)
        except Exception as error:  # a plug-in is somebody else's code: there are other tactics
            problems.append(f"tactic {name} makes no plan: {type(error).__name__}: {error}")
        else:
            proposed += [plan] if plan else []
    kept: list[Plan] = []
    for plan in sorted(proposed, key=lambda plan: plan.cost):
        if plan.steps not in [other.steps for other in kept]:
            kept.append(plan)
    return kept, problems


def load_tactics() -> dict[str, Tactic]:
    """Return the tactics that packages export, by name.

    Raises:
        TacticError: an export can't be used.
    """
    found: dict[str, Tactic] = {}
    for package, attributes in exported(PACKAGE):
        if "tactic" not in attributes:
            continue
        name, function = attributes["tactic"], attributes.get("function", "")
        if name in found:
            raise TacticError(f"package {package}: package.xml: tactic {name!r} exists already: rename it")
        module, _, attribute = function.partition(":")
        try:
            found[name] = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise TacticError(f"package {package}: tactic {name!r} names function {function!r}: {error}") from error
    return found


def _settings(values: Mapping[str, Any], adjustable: Mapping[str, Adjustable]) -> list[SetParameters] | None:
    """Return the calls that set all values, one per server; None where one can't be set."""
    by_server: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        found = adjustable.get(key)
        if found is None or not found.takes(value):
            return None
        by_server.setdefault(found.server, {})[found.name] = float(value) if found.kind == "double" else value
    return [SetParameters(server, settings) for server, settings in by_server.items()]
