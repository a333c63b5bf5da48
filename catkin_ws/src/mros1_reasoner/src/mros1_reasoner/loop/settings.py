"""How the loop behaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Settings:
    """How the loop behaves; times in s.

    Attributes:
        violation_window: a limit must be passed for so long before it counts.
        cool_down: so long after an adaptation no limit counts; component failures always do.
        level_timeout: a level older than this is no longer known.
        error_log_expiry: so long a design that was tried in vain is not tried again.
        backoff: wait after a failed reconfiguration; doubled with each further one.
        backoff_limit: the longest such wait.
        start_grace: so long after the first step the running configuration is waited for.
        busy_limit: so long a reconfiguration by somebody else is waited for.
        utility: quality attribute whose expected level is the utility, or a plug-in with its parameters.
        desired: configuration that is asked for where none runs.
        always_improve: adapt also when a clearly better design has become available, because a component works again
            or the operator has changed a limit; an objective may say otherwise.
        improvement: utility that such a design must have more.
        worth: where no design keeps every limit, another one must violate them by so much less, as a share of a limit.
        correct_expected: multiply expected levels by the ratio of observed to expected ones of the deployed design.
        correction_limit: that ratio at most, or one by it.
        correction_memory: time constant of the average of that ratio.
        approval: a decision waits until an operator approves it.
        dry_run: what would be done is told once, as ADVISED, and not carried out.
    """

    violation_window: float = 2.0
    cool_down: float = 5.0
    level_timeout: float = 5.0
    error_log_expiry: float = 60.0
    backoff: float = 1.0
    backoff_limit: float = 30.0
    start_grace: float = 15.0
    busy_limit: float = 60.0
    utility: str | Mapping[str, Any] = "performance"
    desired: str = ""
    always_improve: bool = False
    improvement: float = 0.05
    worth: float = 0.1
    correct_expected: bool = True
    correction_limit: float = 2.5
    correction_memory: float = 30.0
    approval: bool = False
    dry_run: bool = False
