"""The monitor's parameters, read and checked."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import rospy
from node_kit.parameters import ParameterError, ParameterTree
from ros_model.io.files import resolve

from rosgraph_monitor.evaluation import Patience
from rosgraph_monitor.graph.comparison import Scope
from rosgraph_monitor.graph.defaults import parameter_defaults
from rosgraph_monitor.graph.names import IGNORED_NODES, IGNORED_PORTS
from rosgraph_monitor.graph.wiring import port_types
from rosgraph_monitor.health.components import ComponentMap, parse_components
from rosgraph_monitor.health.liveness import Timing
from rosgraph_monitor.health.topics import TopicSpec, parse_topics
from rosgraph_monitor.observer import LOWEST_RATE

if TYPE_CHECKING:
    from ros_model.language.packages import PackageSet

PARAMETERS = (
    "components",
    "desired_rossystem",
    "ignore",
    "ignore_ports",
    "master_patience",
    "metacontrol_nodes",
    "observers",
    "port_patience",
    "probe_deadline",
    "probe_period",
    "rate",
    "recovery_time",
    "restart_patience",
    "ros_models",
    "startup_grace",
    "topics",
    "variants",
)
"""Names of all parameters, but for those of observers: each observer has a group of its own, of its name."""
_HIGHEST_POLL_RATE = 100.0
"""Hz. Each poll takes the master some ms."""


def strangers() -> list[str]:
    """Return what to say of each parameter that nobody reads; a group may be one of an observer that comes later."""
    own = _own()
    groups = [
        str(name)
        for name, value in own.values.items()
        if isinstance(value, Mapping) and not difflib.get_close_matches(str(name), PARAMETERS)
    ]
    return own.strangers((*PARAMETERS, *groups))


def number(name: str, default: float) -> float:
    """Return a positive number."""
    return _own().number(name, default, low=0.0, above=True)


def poll_rate() -> float:
    """Return how often the graph is looked at, in Hz."""
    return _own().number("rate", 2.0, low=LOWEST_RATE, high=_HIGHEST_POLL_RATE)


def text(name: str) -> str:
    """Return a text, "" where it is not set."""
    return _own().text(name)


def names(name: str, default: list[str]) -> list[str]:
    """Return a list of names."""
    return _own().texts(name, default)


def components() -> ComponentMap:
    """Return what stands for components."""
    try:
        return parse_components(rospy.get_param("~components", {}))
    except ValueError as error:
        raise ParameterError(f"parameter {rospy.resolve_name('~components')}: {error}") from error


def topics() -> Mapping[str, TopicSpec]:
    """Return what is expected of topics."""
    try:
        return parse_topics(rospy.get_param("~topics", {}))
    except ValueError as error:
        raise ParameterError(f"parameter {rospy.resolve_name('~topics')}: {error}") from error


def timing() -> Timing:
    """Return periods and deadlines of probes."""
    return Timing(
        probe_period=number("probe_period", Timing.probe_period),
        probe_deadline=number("probe_deadline", Timing.probe_deadline),
    )


def patience() -> Patience:
    """Return how long the monitor waits before it reports a change."""
    return Patience(
        startup=number("startup_grace", Patience.startup),
        restart=number("restart_patience", Patience.restart),
        ports=number("port_patience", Patience.ports),
        recovery=number("recovery_time", Patience.recovery),
    )


def scope(specs: Mapping[str, TopicSpec]) -> Scope:
    """Return what is compared, given what is expected of topics.

    Raises:
        ParameterError: a parameter has the wrong type.
        ModelError: a `.ros` model can't be read.
    """
    models = _models(names("ros_models", []))
    return Scope(
        ignored_nodes=(*IGNORED_NODES, *names("ignore", [])),
        ignored_ports=(*IGNORED_PORTS, *names("ignore_ports", [])),
        types=port_types(models),
        defaults=parameter_defaults(models),
        topic_types={name: spec.type for name, spec in specs.items() if spec.type},
        namespace=rospy.get_namespace(),
    )


def _own() -> ParameterTree:
    return ParameterTree(rospy.get_param("~", {}), rospy.get_name())


def _models(paths: list[str]) -> list[PackageSet]:
    if not paths:
        return []
    from ros_model.io.models import read_packages  # grammars take a while to load: only where they are needed

    return [read_packages(resolve(path)) for path in paths]
