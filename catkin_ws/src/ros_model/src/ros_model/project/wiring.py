"""The components that a variant requires, by its wiring or by the values of its parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.language.metamodel import RosSystem, compose

if TYPE_CHECKING:
    from collections.abc import Mapping


def required_components(base: RosSystem, variant: RosSystem) -> frozenset[str]:
    """Return the components of the base that feed the variant's, directly or through others.

    The search stops at a component that the variant itself drives: that one is the plant (a robot's base takes
    the velocity and gives the odometry). The variant requires it, but not the other components that act on it.
    """
    system = compose(base, variant)
    own = {component.name for component in variant.components}
    feeds: dict[str, set[str]] = {}
    for connection in system.connections:
        for target in connection.targets:
            feeds.setdefault(target.component, set()).update(source.component for source in connection.sources)
    driven = {target for target, sources in feeds.items() if sources & own}
    required: set[str] = set()
    waiting = list(own)
    while waiting:
        for source in feeds.get(waiting.pop(), ()):
            if source not in required | own:
                required.add(source)
                if source not in driven:
                    waiting.append(source)
    return frozenset(required)


def required_by_parameters(variant: RosSystem, requires: Mapping[str, Mapping[str, str]]) -> frozenset[str]:
    """Return the components that a variant's parameter values ask for, for models that have no wiring.

    Args:
        variant: the system.
        requires: parameter (its key, or the key's last part) -> value -> component. A value of the variant may be
            several, separated by blanks, as in costmap_2d's observation_sources.
    """
    found: set[str] = set()
    for component in variant.components:
        for parameter in component.parameters:
            choices = requires.get(parameter.key) or requires.get(parameter.key.rsplit("/", 1)[-1]) or {}
            found.update(choices[value] for value in str(parameter.value).split() if value in choices)
    return frozenset(found)
