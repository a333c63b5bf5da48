"""Checks of launch files: the hosts that they name, and the executables that this host starts."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.findings import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from ros_model.language.library import Installed

_HOST_NAME = re.compile(r"\w([\w.-]{0,251}\w)?\.?", re.ASCII)


@dataclass(frozen=True)
class LaunchedNode:
    """A node of a launch file, and the name of the machine that starts it; an empty one is the own host."""

    name: str
    package: str
    executable: str
    machine: str = ""


@dataclass(frozen=True)
class LaunchFile:
    """What a launch file starts, and the addresses of the machines that it declares, by their names."""

    path: str
    nodes: tuple[LaunchedNode, ...]
    machines: Mapping[str, str]


def check_launch_file(launch: LaunchFile, installed: Installed) -> Iterator[Finding]:
    """Yield machines that are not declared or that no host can be, and executables that roslaunch does not find here.

    Args:
        launch: the launch file.
        installed: knows the packages of this host. Nodes of other hosts are not looked for.
    """
    for name, address in launch.machines.items():
        if not _may_be_host(address):
            yield Finding(
                f"{launch.path}: machine '{name}' has the address '{address}', which no host can have: give a host's "
                "name or IP address, without user and port",
                None,
                "host",
            )
    for node in launch.nodes:
        if node.machine and node.machine not in launch.machines:
            yield Finding(
                f"{launch.path}: node {node.name} is for machine '{node.machine}', which is not declared: add "
                f'<machine name="{node.machine}" address="HOST"/>, or correct the name',
                None,
                "host",
            )
        elif not node.machine or launch.machines[node.machine] == "localhost":
            problem = installed.missing_executable(node.package, node.executable)
            if problem:
                message = f"{launch.path}: node {node.name}: {problem.message}"
                yield Finding(message, None, "executable", problem.severity)


def _may_be_host(address: str) -> bool:
    """Tell whether a text is a host's name, or an address that one host can have."""
    try:
        number = ipaddress.ip_address(address)
    except ValueError:
        digits_only = address.replace(".", "").isdigit()  # such as 192.0.2.300
        return bool(_HOST_NAME.fullmatch(address)) and not digits_only
    return not (number.is_unspecified or number.is_multicast or str(number) == "255.255.255.255")
