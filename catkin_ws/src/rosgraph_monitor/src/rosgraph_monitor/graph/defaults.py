"""Values that the code of nodes takes for parameters that nobody sets, as `.ros` models declare them. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.metamodel import Component, RosParameter, Value
    from ros_model.language.packages import PackageSet

Defaults = dict[tuple[str, str, str], "Value | None"]
"""Default of a parameter by package, artifact and name relative to the node; None where nodes of it differ.

The node's name is no part of it: a snapshot knows the name in the graph, the source that in the code.
"""


def parameter_defaults(models: Iterable[PackageSet]) -> Defaults:
    """Collect the defaults that `.ros` models declare; `rosmodel extract` finds them in the source."""
    found: Defaults = {}
    for model in models:
        for package in model.packages:
            for artifact in package.artifacts:
                for node in artifact.nodes:
                    for parameter in node.parameters:
                        value = parameter.value
                        if value is None and parameter.type:
                            value = parameter.type.default
                        if value is not None:
                            key = package.name, artifact.name, parameter.name.strip("/~")
                            found[key] = value if found.get(key, value) == value else None
    return found


def default_of(parameter: RosParameter, component: Component, defaults: Defaults) -> Value | None:
    """Return the code's default of a component's parameter; None if nothing tells it."""
    reference = parameter.reference or component.executable
    if reference is None:
        return None
    return defaults.get((reference.package, reference.artifact, parameter.key.strip("/~")))
