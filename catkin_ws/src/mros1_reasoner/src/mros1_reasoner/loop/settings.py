"""The settings of the loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Settings:
    """How the loop behaves; times in s.

    Attributes:
        violation_window: how long a limit must be violated before it counts.
        cool_down: how long no limit counts after an adaptation; component failures always count.
        level_timeout: how long a level is valid.
        error_log_expiry: how long a design that failed is not tried again.
        restart_limit: how often within that time a design is deployed again because nodes of it do not work.
        restart_grace: how long after a deployment a failure of the design's nodes does not count: it may be an old one.
        backoff: wait after a failed reconfiguration; doubled with each further one.
        backoff_limit: the longest such wait.
        start_grace: how long the loop waits for a running configuration after its first step.
        busy_limit: how long the loop waits while somebody else reconfigures.
        utility: quality attribute whose expected level is the utility, or a plug-in with its parameters.
        desired: the configuration to deploy when none runs.
        always_improve: adapt also when a clearly better design becomes available, because a component works again
            or the operator has changed a limit; the setting of an objective takes precedence.
        improvement: by how much the utility of such a design must be greater.
        worth: by how much less another design must violate limits, as a share of a limit, when none keeps every limit.
        only_last_limit: plan by the last limit of an objective alone, in the order of the qualities' names, as the
            published reasoner does.
        makeshift: take a design that does not keep every limit, or that failed recently, where there is no other.
        correct_expected: multiply expected levels by the ratio of observed to expected ones of the deployed design.
        correction_limit: the greatest ratio; the least is its reciprocal.
        correction_memory: time constant of the average ratio.
        approval: whether a decision waits until an operator approves it.
        dry_run: whether a decision is published once, as ADVISED, and not carried out.
    """

    violation_window: float = 2.0
    cool_down: float = 5.0
    level_timeout: float = 5.0
    error_log_expiry: float = 60.0
    restart_limit: float = 2.0
    restart_grace: float = 2.0
    backoff: float = 1.0
    backoff_limit: float = 30.0
    start_grace: float = 15.0
    busy_limit: float = 60.0
    utility: str | Mapping[str, Any] = "performance"
    desired: str = ""
    always_improve: bool = False
    improvement: float = 0.05
    worth: float = 0.1
    only_last_limit: bool = False
    makeshift: bool = True
    correct_expected: bool = True
    correction_limit: float = 2.5
    correction_memory: float = 30.0
    approval: bool = False
    dry_run: bool = False
