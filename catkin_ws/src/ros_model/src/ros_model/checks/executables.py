"""Checks that the executables of a system are where roslaunch looks for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.findings import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.language.library import Installed
    from ros_model.language.metamodel import RosSystem


def missing_executables(system: RosSystem, installed: Installed) -> Iterator[Finding]:
    """Yield the executables of components that roslaunch would not find; each fault once.

    Args:
        system: the system whose components a launch file would start.
        installed: knows the packages of this machine.
    """
    told: set[str] = set()
    for component in system.components:
        executable = component.executable
        if executable is None or not executable.artifact:
            continue  # told as an incomplete reference
        problem = installed.missing_executable(executable.package, executable.artifact)
        if problem and problem.message not in told:
            told.add(problem.message)
            place = executable.position if executable.position.line else component.position
            yield Finding(problem.message, place, "executable", problem.severity)
