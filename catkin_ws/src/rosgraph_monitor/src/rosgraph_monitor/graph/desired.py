"""The desired system: the base model composed with the variants that the active configuration names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

from metacontrol_msgs.msg import FunctionGrounding
from ros_model.errors import ModelError
from ros_model.language.metamodel import RosSystem, compose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

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
        problem: why the last good model was kept; empty if all is well.
    """

    system: RosSystem | None
    variant_nodes: frozenset[str] = frozenset()
    excused: frozenset[str] = frozenset()
    problem: str = ""


class DesiredModel:
    """Follows the active configuration. A variant that can't be read leaves the last good model in force."""

    def __init__(self, base: RosSystem | None, read_variant: Callable[[str], RosSystem]) -> None:
        """Start from the base alone.

        Args:
            base: the base system, or None to desire nothing in particular.
            read_variant: reads the variant of a name; raises ModelError.
        """
        self._base = base
        self._read = read_variant
        self._variants: dict[str, RosSystem] = {}
        self._stable: dict[str, str] = {}
        self.current = Desired(base)

    def follow(self, groundings: Iterable[Grounding]) -> Desired:
        """Take in the active configuration, and return what should run now."""
        groundings = tuple(groundings)
        try:
            active = [self._variant(g.configuration) for g in groundings if g.configuration]
            in_change = [self._variant(name) for g in groundings if g.state in _IN_CHANGE for name in self._names(g)]
        except ModelError as error:
            self.current = Desired(
                self.current.system, self.current.variant_nodes, self.current.variant_nodes, problem=str(error)
            )
            return self.current
        self._stable |= {g.function: g.configuration for g in groundings if g.state == FunctionGrounding.STABLE}
        self.current = Desired(
            None if self._base is None else reduce(compose, active, self._base),
            variant_nodes=_nodes(active),
            excused=_nodes(in_change),
        )
        return self.current

    def _names(self, grounding: Grounding) -> list[str]:
        """Return the configurations between which a function changes."""
        return [name for name in {grounding.configuration, self._stable.get(grounding.function, "")} if name]

    def _variant(self, name: str) -> RosSystem:
        if name not in self._variants:
            self._variants[name] = self._read(name)
        return self._variants[name]


def _nodes(systems: Iterable[RosSystem]) -> frozenset[str]:
    return frozenset(component.graph_name for system in systems for component in system.components)
