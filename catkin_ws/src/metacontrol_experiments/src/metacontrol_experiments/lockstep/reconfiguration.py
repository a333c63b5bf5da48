"""The manipulator in lockstep: how a configuration is changed into another, by the manipulator's own tactics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosgraph_manipulator.change import tactics as manipulator

from metacontrol_experiments.lockstep.navigation import RunningNavigation, navigation_node
from metacontrol_experiments.lockstep.system import LockstepError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from metacontrol_experiments.lockstep.system import System


def plan_change(
    system: System, running: str, wanted: str, tactics: Mapping[str, manipulator.Tactic]
) -> manipulator.Plan:
    """Return the cheapest plan from the running to the wanted configuration.

    Raises:
        LockstepError: no tactic has one, or the wanted configuration has nodes that lockstep cannot run.
    """
    navigation_node(system, wanted)
    nodes = RunningNavigation(system, running)
    found, problems = manipulator.plan_change(system.describe(running), system.describe(wanted), nodes, tactics)
    if not found:
        reasons = "; ".join(problems) or "no tactic has a plan"
        raise LockstepError(f"{running} cannot be changed into {wanted}: {reasons}; export a tactic that can")
    return found[0]


def restarts(plan: manipulator.Plan) -> bool:
    """Tell whether a plan starts or stops nodes; without that, the robot drives on."""
    return bool(plan.touched)
