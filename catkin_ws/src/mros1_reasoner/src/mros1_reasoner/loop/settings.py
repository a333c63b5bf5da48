"""The settings of the loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

_MOST_DOUBLINGS = 30  # of a wait; a float holds more, but no robot waits as long
_LONGEST_RETRY = 10.0  # times `error_log_expiry`


@dataclass(frozen=True)
class Settings:
    """How the loop behaves; times in s.

    Attributes:
        history: how many levels of a quality are judged together.
        confidence: the quantile of the next levels that must keep the limit.
        horizon: how far ahead a trend of levels is followed.
        violation_window: how long a limit must be violated before it counts, where levels come too rarely to fill most
            of the history.
        cool_down: how long no limit counts after an adaptation; component failures always count.
        level_timeout: how long a level is valid.
        error_log_expiry: how long a design that failed is not tried again; a deployment that ends sooner did not last.
        restart_limit: how often within that time a design is deployed again because nodes of it do not work.
        restart_grace: how long after a deployment a failure of the design's nodes does not count: it may be an old one.
        backoff: wait after a failed reconfiguration, and before a design is tried again that did not last; doubled with
            each further one.
        backoff_limit: the longest such wait.
        start_grace: how long the loop waits for a running configuration after its first step.
        busy_limit: how long the loop waits while somebody else reconfigures.
        utility: quality attribute whose expected level is the utility, or a plug-in with its parameters.
        desired: the configuration to deploy when none runs.
        relief: share by which a quality must become better for the cause of a violation to be gone, and by which
            another design must keep a limit that is violated if there is one; of the limit, or of the span of the
            expected levels where these are on no ratio scale.
        calm: how long that cause must be gone before a better design is taken again; doubled with each time that the
            same happens again soon after.
        relapse_limit: how often in a row a limit is violated again soon after the return to a better design until the
            design itself is held to be the cause: then it is one that failed.
        always_improve: adapt also when a clearly better design becomes available, because a component works again,
            the cause of a violation is gone, a design that failed may be tried again, or the operator has changed a
            limit; the setting of an objective takes precedence. A design that failed may be tried again in place of a
            working one after `error_log_expiry`, after twice the time where it fails again, up to ten times as long.
        improvement: by how much the utility of such a design must be greater.
        indifference: designs whose utility is less than the greatest by at most this are as useful: of these, the one
            that keeps its limits best is taken.
        worth: by how much less another design must violate limits, as a share of a limit, when none keeps every limit.
        only_last_limit: plan by the last limit of an objective alone, in the order of the qualities' names, as the
            published reasoner does.
        repairs: whether components are repaired; False: only other designs are taken.
        outlook: for how long the choice between a repair and another design counts.
        change_duration: how long a change takes, until changes have been measured.
        makeshift: take a design that does not keep every limit, or that failed recently, where there is no other.
        correct_expected: correct expected levels as the observed ones of the deployed design differ from them.
        correction_limit: the greatest factor; the least is its reciprocal.
        correction_memory: time constant by which a correction fades that nothing confirms.
        approval: whether a decision waits until an operator approves it.
        dry_run: whether a decision is published once, as ADVISED, and not carried out.
    """

    history: float = 5.0
    confidence: float = 0.95
    horizon: float = 0.1
    violation_window: float = 2.0
    cool_down: float = 1.0
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
    relief: float = 0.2
    calm: float = 1.0
    relapse_limit: float = 1.0
    always_improve: bool = True
    improvement: float = 0.05
    indifference: float = 0.0
    worth: float = 0.1
    only_last_limit: bool = False
    repairs: bool = True
    outlook: float = 60.0
    change_duration: float = 1.5
    makeshift: bool = True
    correct_expected: bool = True
    correction_limit: float = 2.5
    correction_memory: float = 30.0
    approval: bool = False
    dry_run: bool = False

    def wait_after(self, attempts: int) -> float:
        """Return the wait after an attempt that has failed, s, where so many before it have failed in a row."""
        return self._doubled(self.backoff, attempts)

    def retry_after(self, failures: int) -> float:
        """Return how long a failed design does not replace a working one, s, after so many failures in a row before."""
        return self.error_log_expiry * min(2.0 ** min(failures, _MOST_DOUBLINGS), _LONGEST_RETRY)

    def calm_after(self, relapses: int) -> float:
        """Return how long the cause of a violation must be gone before a better design is taken again, s."""
        return max(self._doubled(self.calm, relapses), self.calm)

    def _doubled(self, wait: float, times: int) -> float:
        return float(min(wait * 2 ** min(times, _MOST_DOUBLINGS), self.backoff_limit))


def setting_names() -> list[str]:
    """Return the names of the parameters that say how the reasoner behaves: any model goes with any of them."""
    return [*(item.name for item in fields(Settings) if item.name != "desired"), "reasoner"]
