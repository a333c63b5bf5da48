"""How far a campaign is: attempts at a run, what is still to do, and the rows of its table."""

from __future__ import annotations

import json
from dataclasses import MISSING, asdict, dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any

from ros_model.project.schema_check import violations

from metacontrol_experiments.campaign.matrix import CampaignError, Run

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MOST_ATTEMPTS = 2
"""A run that crashed or hung is tried once more."""
PROVENANCE = ("commit", "host", "ended", "versions")
"""What a result tells of where it comes from."""
LONGEST_LOG = 200_000
"""Bytes of an attempt's log that are kept, the last ones."""
_MOST = 2**53
"""A table's columns of numbers hold no whole number beyond."""

_TEXT = {"type": "string", "title": "text"}
_FLAG = {"type": "boolean", "title": "true or false"}
_NUMBER = {"type": "number", "minimum": -_MOST, "maximum": _MOST, "title": "a number"}
_WHOLE = {**_NUMBER, "type": "integer", "title": "a whole number"}
_TEXTS = {"type": "array", "items": _TEXT, "title": "a list of texts"}
_KINDS = {"str": _TEXT, "int": _WHOLE, "float": _NUMBER, "bool": _FLAG, "tuple[str, ...]": _TEXTS}
_RUN = {item.name: _KINDS[str(item.type)] for item in fields(Run)}


def _maybe(kind: Mapping[str, Any]) -> dict[str, Any]:
    return {"anyOf": [kind, {"const": None}], "title": f"{kind['title']}, or null"}


_LEVELS = {"type": "object", "title": "levels by name", "additionalProperties": _maybe(_NUMBER)}
_SUMMARY = {
    "type": "object",
    "title": "the summary of a mission",
    "required": ["reconfigurations"],
    "properties": {
        "reconfigurations": {"type": "array", "title": "a list"},
        "time_above_threshold": _LEVELS,
        "mean_qa": _LEVELS,
        **dict.fromkeys(("outcome", "final_configuration"), _maybe(_TEXT)),
        **dict.fromkeys(("success", "goal_reached"), _maybe(_FLAG)),
        **dict.fromkeys(("duration_s", "path_length_m"), _maybe(_NUMBER)),
        "collisions": _maybe(_WHOLE),
    },
}
_ATTEMPT = {
    "type": "object",
    "title": "an attempt",
    "required": ["wall_s", "problem"],
    "properties": {"wall_s": _NUMBER, "problem": _TEXT},
}
_SCHEMA = {
    "type": "object",
    "properties": {
        "run": {"type": "object", "title": "a run", "required": list(_RUN), "properties": _RUN},
        "attempts": {"type": "array", "minItems": 1, "items": _ATTEMPT, "title": "a list of attempts"},
        "summary": _maybe(_SUMMARY),
        "provenance": {"type": "object", "title": "texts by name", "additionalProperties": _maybe(_TEXT)},
    },
}
"""What a row of the table needs of a result."""


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


def remaining(runs: Iterable[Run], results: Mapping[str, Result]) -> list[Run]:
    """Return the runs without a result, in their order; the results are known by the run's name."""
    return [run for run in runs if run.name not in results]


def check_same(runs: Iterable[Run], results: Mapping[str, Result], where: str, remedy: str) -> None:
    """Check that results are those of the runs.

    Args:
        runs: of the campaign.
        results: those that are there, by the run's name.
        where: their folder or table, for messages.
        remedy: what to do where one is that of another mission.

    Raises:
        CampaignError: one is that of another mission.
    """
    for run in runs:
        found = results.get(run.name)
        if found is not None and found.run != run:
            differing = [item.name for item in fields(Run) if getattr(run, item.name) != getattr(found.run, item.name)]
            raise CampaignError(f"{where}/{run.name}: is another mission ({', '.join(differing)}): {remedy}")


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
        return _checked(Result(run, attempts, content["summary"], content["provenance"]))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise CampaignError(f"{where}: is no result of a run ({error}): delete it to drive the run again") from error


def run_of(content: Mapping[str, Any]) -> Run:
    """Return the run of a row of a table, which may lack the columns of later versions.

    Raises:
        AttributeError, KeyError, TypeError: it lacks others, or a value is none.
    """
    given = {item.name: content[item.name] for item in fields(Run) if item.default is MISSING or item.name in content}
    return Run(**{**given, "contingencies": tuple((content["contingencies"] or "").split())})


def from_row(content: Mapping[str, Any], where: str) -> Result:
    """Return the result of a row of a table. Of attempts before the last one, it knows only that they were.

    Raises:
        CampaignError: it is none.
    """
    try:
        run = run_of(content)
        before = int(content["attempts"]) - 1
        if not 0 <= before < MOST_ATTEMPTS:
            raise ValueError(f"{before + 1} attempts")
        last = Attempt(Status(content["status"]), content["wall_s"], content["problem"])
        attempts = (*(Attempt(Status.CRASHED, 0.0) for _ in range(before)), last)
        summary = json.loads(content["summary"]) if content["summary"] else None
        return _checked(Result(run, attempts, summary, {name: content[name] for name in PROVENANCE}))
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise CampaignError(f"{where}: is no result of a run ({error}): name a table of a campaign") from error


def _checked(result: Result) -> Result:
    """Return a result that a table can hold.

    Raises:
        ValueError: it is none; the message names the place.
    """
    run = {**asdict(result.run), "contingencies": list(result.run.contingencies)}
    attempts = [{"wall_s": attempt.wall_s, "problem": attempt.problem} for attempt in result.attempts]
    content = {"run": run, "attempts": attempts, "summary": result.summary, "provenance": result.provenance}
    for violation in violations(content, _SCHEMA):
        raise ValueError(str(violation))
    if result.status is Status.DONE and result.summary is None:
        raise ValueError("summary: is missing, though the run is done")
    json.dumps(content, ensure_ascii=False).encode()  # half of a surrogate pair is no text
    return result


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
        **{name: result.provenance.get(name) for name in PROVENANCE},
        "summary": json.dumps(result.summary) if result.summary else None,
    }
