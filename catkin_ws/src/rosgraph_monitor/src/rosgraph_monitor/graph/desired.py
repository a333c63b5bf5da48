"""The desired system: what runs for the functions, by the active configuration, and what belongs to no function."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING

from metacontrol_msgs.msg import FunctionGrounding
from ros_model.errors import ModelError
from ros_model.language.metamodel import PortKind, RosSystem, compose

from rosgraph_monitor.graph.findings import NO_NODE
from rosgraph_monitor.graph.names import system_parameter_name

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from ros_model.language.metamodel import Component

_IN_CHANGE = frozenset({FunctionGrounding.RECONFIGURING, FunctionGrounding.RECOVERING})


@dataclass(frozen=True)
class Grounding:
    """A function, the configuration that provides it, and its state (as in FunctionGrounding messages)."""

    function: str
    configuration: str
    state: str


@dataclass(frozen=True)
class Desired:
    """What should run now.

    Attributes:
        system: the composed model; None where there is no base.
        variant_nodes: names of the nodes that a variant brings, and that the manipulator looks after.
        excused: names of the nodes that are being reconfigured, and raise no alarm.
        idle: components of the base that belong only to functions for which nothing is deployed, such as a function
            that was released. Their nodes may run or not.
        idle_topics: topics that by their models only variants publish, and none that is deployed.
        deployed: name and model of each configuration that is deployed.
        problem: why the last good model was kept; empty if all is well.
    """

    system: RosSystem | None
    variant_nodes: frozenset[str] = frozenset()
    excused: frozenset[str] = frozenset()
    idle: tuple[Component, ...] = ()
    idle_topics: frozenset[str] = frozenset()
    deployed: tuple[tuple[str, RosSystem], ...] = ()
    problem: str = ""

    @property
    def idle_nodes(self) -> frozenset[str]:
        """Names of the nodes of the idle components."""
        return frozenset(component.graph_name for component in self.idle)

    def configurations_of(self, node: str, parameters: Collection[str]) -> tuple[str, ...]:
        """Return the deployed configurations that set parameters of a node, or of the system if `node` is NO_NODE."""

        def sets(system: RosSystem) -> bool:
            if node != NO_NODE:
                return any(component.graph_name == node for component in system.components)
            return any(system_parameter_name(parameter) in parameters for parameter in system.parameters)

        return tuple(name for name, system in self.deployed if sets(system))


class DesiredModel:
    """Follows the active configuration. A deployed variant that can't be read leaves the last good model in force."""

    def __init__(
        self,
        base: RosSystem | None,
        read_variant: Callable[[str], RosSystem],
        read_all: Callable[[], Iterable[RosSystem | ModelError]] = tuple,
    ) -> None:
        """Start from the base alone: as long as nobody tells what is deployed, all of it should run.

        Args:
            base: the base system, or None to desire nothing in particular.
            read_variant: reads the variant of a name; raises ModelError.
            read_all: gives all variants: a component that one of them has belongs to a function. Gives an error in the
                place of each that can't be read. It is asked again and again, since files may come later.
        """
        self._base = base
        self._read = read_variant
        self._read_all = read_all
        self._of_functions: tuple[Component, ...] = ()
        self._variants: dict[str, RosSystem] = {}
        self._stable: dict[str, str] = {}
        self._groundings: tuple[Grounding, ...] = ()
        self._is_told = False  # what is deployed
        self.current = Desired(base)

    def follow(self, groundings: Iterable[Grounding]) -> Desired:
        """Take in the active configuration, and return what should run now."""
        self._groundings, self._is_told = (groundings := tuple(groundings)), True
        try:
            active = [self._variant(g.configuration) for g in groundings if g.configuration]
            in_change = [self._variant(name) for g in groundings if g.state in _IN_CHANGE for name in self._names(g)]
        except Exception as error:  # such as for want of memory
            why = str(error) if isinstance(error, ModelError) else f"{type(error).__name__}: {error}"
            self.current = replace(self.current, excused=self.current.variant_nodes, problem=why)
            return self.current
        self._stable |= {g.function: g.configuration for g in groundings if g.state == FunctionGrounding.STABLE}
        names = (g.configuration for g in groundings if g.configuration)
        deployed = tuple(zip(names, active, strict=True))
        desired = Desired(None, _nodes(active), _nodes(in_change), deployed=deployed)
        self.current = desired if self._base is None else self._with_system(desired, self._base, active)
        return self.current

    def look_again(self) -> Desired:
        """Try again to read what could not be read, and return what should run now."""
        is_more_known = self._base is not None and self._is_told and self._look_at_functions()
        return self.follow(self._groundings) if self.current.problem or is_more_known else self.current

    def _with_system(self, desired: Desired, base: RosSystem, active: Sequence[RosSystem]) -> Desired:
        """Return what should run, with the base composed with the active variants, and without what is idle."""
        self._look_at_functions()
        idle = {c.name for c in self._of_functions} - {c.name for variant in active for c in variant.components}
        system = reduce(compose, active, _without(base, idle))
        return replace(
            desired,
            system=system,
            idle=tuple(component for component in base.components if component.name in idle),
            idle_topics=_published(self._of_functions) - _published(system.components),
        )

    def _look_at_functions(self) -> bool:
        """Read what belongs to functions. Return whether that is other than before."""
        before, found = self._of_functions, tuple(self._read_all())
        self._of_functions = tuple(c for variant in found if isinstance(variant, RosSystem) for c in variant.components)
        return self._of_functions != before

    def _names(self, grounding: Grounding) -> list[str]:
        """Return the configurations between which a function changes."""
        return [name for name in {grounding.configuration, self._stable.get(grounding.function, "")} if name]

    def _variant(self, name: str) -> RosSystem:
        if name not in self._variants:
            self._variants[name] = self._read(name)
        return self._variants[name]


def _without(system: RosSystem, names: Collection[str]) -> RosSystem:
    """Return a system without some of its components; a connection that has lost an end is not judged."""
    return replace(system, components=tuple(c for c in system.components if c.name not in names))


def _published(components: Iterable[Component]) -> frozenset[str]:
    """Return the topics that components publish by their models."""
    return frozenset(p.name.strip("/") for c in components for p in c.ports if p.kind is PortKind.PUBLISHER)


def _nodes(systems: Iterable[RosSystem]) -> frozenset[str]:
    return frozenset(component.graph_name for system in systems for component in system.components)
