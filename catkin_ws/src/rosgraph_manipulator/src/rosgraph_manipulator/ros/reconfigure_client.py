"""Client of dynamic_reconfigure: asks running nodes which parameters they take, and sets them."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from concurrent.futures import TimeoutError  # noqa: A004
from functools import partial
from typing import Any

import rospy
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    DoubleParameter,
    IntParameter,
    StrParameter,
)
from dynamic_reconfigure.srv import Reconfigure
from node_kit.io.background import in_background
from node_kit.io.xml_rpc import CallError
from node_kit.ros.services import SERVICE_FAILURES
from rosgraph_launcher.io.master import NodeApi

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.tactics import Adjustable
from rosgraph_manipulator.configuration.difference import same_value
from rosgraph_manipulator.io.master import services_of

DESCRIPTION_TIMEOUT = 1.0  # s, wall, for all servers of a node to describe themselves
SET_TIMEOUT = 1.0  # s, wall, for a server to take values
SERVICE = "/set_parameters"


class ReconfigureClient:
    """Asks nodes for their descriptions, and keeps each as long as the node has the same address and servers."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[object, Mapping[str, Adjustable]]] = {}

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:
        """Return what a node takes, by the parameter's name relative to the node's; nothing if it does not answer."""
        address = NodeApi.address(node)
        if address is None:
            return {}
        try:
            identity = (address, servers := _servers(node))
        except CallError as error:
            rospy.logwarn("node %s is not asked for its parameters: %s", node, error)
            return {}
        known = self._known.get(node)
        if known is None or known[0] != identity:
            self._known[node] = known = (identity, _ask(node, servers))
        return known[1]

    def set(self, server: str, values: Mapping[str, Any]) -> None:
        """Set values at a server, and check that the server has them.

        Raises:
            DeploymentError: the server does not answer, or has other values.
        """
        proxy = rospy.ServiceProxy(server + SERVICE, Reconfigure)
        future = in_background(partial(proxy, _config(values)), f"values for {server}")
        try:
            answer = future.result(SET_TIMEOUT)
        except TimeoutError as error:
            raise DeploymentError(f"{server} does not answer within {SET_TIMEOUT:g} s") from error
        except SERVICE_FAILURES as error:
            raise DeploymentError(f"{server} does not take the parameters: {error}") from error
        taken = _values(answer.config)
        for name, value in values.items():
            if name not in taken or not same_value(taken[name], value):
                raise DeploymentError(f"{server} has {name} = {taken.get(name)} where {value} is wanted")


def _servers(node: str) -> list[str]:
    return sorted(
        name.removesuffix(SERVICE)
        for name in services_of(node)
        if name.endswith(SERVICE) and (name == node + SERVICE or name.startswith(f"{node}/"))
    )


def _ask(node: str, servers: list[str]) -> dict[str, Adjustable]:
    descriptions: dict[str, ConfigDescription] = {}
    complete = threading.Event()

    def take(server: str, description: ConfigDescription) -> None:
        descriptions[server] = description
        if len(descriptions) == len(servers):
            complete.set()

    if not servers:
        return {}
    subscribers = [
        rospy.Subscriber(f"{server}/parameter_descriptions", ConfigDescription, partial(take, server))
        for server in servers
    ]
    complete.wait(DESCRIPTION_TIMEOUT)
    for subscriber in subscribers:
        subscriber.unregister()
    found = {}
    for server, description in list(descriptions.items()):
        prefix = f"{server}/".removeprefix(f"{node}/")
        found.update({prefix + taken.name: taken for taken in _described(server, description)})
    return found


def _described(server: str, description: ConfigDescription) -> list[Adjustable]:
    low, high = _values(description.min), _values(description.max)
    return [
        Adjustable(server, parameter.name, parameter.type, low[parameter.name], high[parameter.name])
        if parameter.type in ("int", "double")
        else Adjustable(server, parameter.name, parameter.type)
        for group in description.groups
        for parameter in group.parameters
        if parameter.type in ("bool", "str") or (parameter.name in low and parameter.name in high)
    ]


def _values(config: Config) -> dict[str, Any]:
    return {entry.name: entry.value for entry in (*config.bools, *config.ints, *config.strs, *config.doubles)}


def _config(values: Mapping[str, Any]) -> Config:
    config = Config()
    for name, value in values.items():
        if isinstance(value, bool):
            config.bools.append(BoolParameter(name, value))
        elif isinstance(value, int):
            config.ints.append(IntParameter(name, value))
        elif isinstance(value, float):
            config.doubles.append(DoubleParameter(name, value))
        else:
            config.strs.append(StrParameter(name, str(value)))
    return config
