"""How far a campaign is: attempts at a run, what is still to do, and the rows of its table."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.campaign.matrix import CampaignError, Run

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MOST_ATTEMPTS = 2
"""A run that crashed or hung is tried once more."""
LONGEST_LOG = 200_000
"""Bytes of an attempt's log that are kept, the last ones."""


class Status(Enum):
    """How an attempt at a run ended."""

    DONE = "done"
    CRASHED = "crashed"
    HUNG = "hung"


@dataclass(frozen=True)
class Attempt:
    """One attempt at a run.

    Attributes:
        status: how it ended.
        wall_s: how long it took, s.
        problem: one line, empty where it is done.
        log: what it said.
    """

    status: Status
    wall_s: float
    problem: str = ""
    log: str = ""


@dataclass(frozen=True)
class Result:
    """What became of a run.

    Attributes:
        run: what was asked for.
        attempts: the last one counts.
        summary: of the mission; None where no attempt was done.
        provenance: commit, host and versions, and when it ended.
    """

    run: Run
    attempts: tuple[Attempt, ...]
    summary: Mapping[str, Any] | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def status(self) -> Status:
        """How the run ended."""
        return self.attempts[-1].status


def is_final(attempts: Sequence[Attempt]) -> bool:
    """Tell whether a run is not tried again."""
    return bool(attempts) and (attempts[-1].status is Status.DONE or len(attempts) >= MOST_ATTEMPTS)


def remaining(runs: Iterable[Run], results: Mapping[str, Result], where: str) -> list[Run]:
    """Return the runs without a result, in their order.

    Args:
        runs: of the campaign.
        results: those that are there, by the run's name.
        where: their folder, for messages.

    Raises:
        CampaignError: one is that of another mission.
    """
    missing = []
    for run in runs:
        found = results.get(run.name)
        if found is None:
            missing.append(run)
        elif found.run != run:
            differing = [item.name for item in fields(Run) if getattr(run, item.name) != getattr(found.run, item.name)]
            raise CampaignError(
                f"{where}/{run.name}: holds another mission ({', '.join(differing)}): name another folder by "
                "--output, or delete this one"
            )
    return missing


def to_json(result: Result) -> str:
    """Return a result as the text of its file; the logs of attempts are files of their own."""
    content = asdict(result)
    for attempt, told in zip(result.attempts, content["attempts"], strict=True):
        del told["log"]
        told["status"] = attempt.status.value
    return json.dumps(content, indent=1) + "\n"


def from_json(text: str, where: str) -> Result:
    """Return the result of a file's text.

    Raises:
        CampaignError: it is none.
    """
    try:
        content = json.loads(text)
        run = Run(**{**content["run"], "contingencies": tuple(content["run"]["contingencies"])})
        attempts = tuple(Attempt(**{**told, "status": Status(told["status"])}) for told in content["attempts"])
        if not attempts:
            raise ValueError("no attempt")
        return Result(run, attempts, content["summary"], content["provenance"])
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise CampaignError(f"{where}: is no result of a run ({error}): delete it to drive the run again") from error


def row(result: Result) -> dict[str, Any]:
    """Return a result as a row of the table: its run, its figures, the whole summary, and where it comes from."""
    run, summary = result.run, result.summary or {}
    above, means = summary.get("time_above_threshold", {}), summary.get("mean_qa", {})
    return {
        **asdict(run),
        "contingencies": " ".join(run.contingencies),
        "status": result.status.value,
        "attempts": len(result.attempts),
        "problem": result.attempts[-1].problem,
        "outcome": summary.get("outcome"),
        "success": summary.get("success"),
        "goal_reached": summary.get("goal_reached"),
        "duration_s": summary.get("duration_s"),
        "path_length_m": summary.get("path_length_m"),
        "collisions": summary.get("collisions"),
        "above_safety": above.get("safety"),
        "above_energy": above.get("energy"),
        "mean_safety": means.get("safety"),
        "mean_energy": means.get("energy"),
        "reconfigurations": len(summary["reconfigurations"]) if summary else None,
        "final_configuration": summary.get("final_configuration"),
        "wall_s": sum(attempt.wall_s for attempt in result.attempts),
        "commit": result.provenance.get("commit"),
        "host": result.provenance.get("host"),
        "ended": result.provenance.get("ended"),
        "versions": result.provenance.get("versions"),
        "summary": json.dumps(result.summary) if result.summary else None,
    }
