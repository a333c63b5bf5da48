"""Summaries of missions side by side: a column for each mission, a row for each figure."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from metacontrol_bags.metrics import verdict

UNKNOWN = "-"


def table(summaries: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Return the rows of a table, the first one with the names of the missions.

    Args:
        summaries: as `metrics.summarise` makes them, by the name of the column.
    """
    return _rows({name: _column(summary) for name, summary in summaries.items()})


def adaptation_table(runs: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Return the rows of a table, the first one with the names of the runs.

    Args:
        runs: as `adaptation.describe_adaptation` makes them, by the name of the column.
    """
    return _rows({name: _adaptation_column(run) for name, run in runs.items()})


def _rows(columns: Mapping[str, Mapping[str, str]]) -> list[list[str]]:
    labels = dict.fromkeys(label for column in columns.values() for label in column)
    cells = ([label, *(column.get(label, UNKNOWN) for column in columns.values())] for label in labels)
    return [["", *columns], *cells]


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as a Markdown table."""
    cells = [[text.replace("|", "\\|") for text in row] for row in rows]
    lines = [f"| {' | '.join(row)} |" for row in cells]
    return "\n".join([lines[0], f"|---|{'---:|' * (len(rows[0]) - 1)}", *lines[1:]])


def short_names(paths: Sequence[Path]) -> list[str]:
    """Return the shortest ends of paths by which they differ; equal paths get a number."""
    parts = [path.parts or (str(path),) for path in paths]
    depth = 1
    while depth < max(map(len, parts), default=0) and len({part[-depth:] for part in parts}) < len(set(parts)):
        depth += 1
    names = [str(Path(*part[-depth:])) for part in parts]
    return [
        f"{name} ({names[: number + 1].count(name)})" if names.count(name) > 1 else name
        for number, name in enumerate(names)
    ]


def _column(summary: Mapping[str, Any]) -> dict[str, str]:
    goals, control = summary["goals"], summary["control"]
    changes = summary["reconfigurations"]
    durations = [change["execute_s"] for change in changes if change["execute_s"] is not None]
    configurations = dict.fromkeys(filter(None, (summary["initial_configuration"], summary["final_configuration"])))
    rows = {
        "mission": f"{summary['mission']}, route {summary['route']}, seed {summary['seed']}, {summary['engine']}",
        "meta-controller": _yes(summary["metacontrol"]),
        "contingency": _contingency(summary["contingency"]),
        "goal reached": _yes(summary["goal_reached"]) if goals["sent"] else UNKNOWN,
        "success (paper's four conditions)": verdict(summary, "; "),
        "outcome": summary["reason"],
        "duration": _number(summary["duration_s"], "s"),
        "way driven": _number(summary["path_length_m"], "m"),
        "collisions": UNKNOWN if summary["collisions"] is None else str(summary["collisions"]),
        "configuration": " -> ".join(configurations) or UNKNOWN,
    }
    rows |= {f"time above the {name} threshold": _share(v) for name, v in summary["time_above_threshold"].items()}
    for name, violations in summary["violations"].items():
        rows[f"violations of the {name} threshold"] = _violations(violations)
    rows |= {f"mean {name}": _number(level) for name, level in summary["mean_qa"].items()}
    for name, observed in summary["observed_qa"].items():
        rows[f"time above the {name} threshold, as observed"] = _share(observed["time_above_threshold"])
        rows[f"{name} could not be observed"] = _number(observed["stale_s"], "s")
    return rows | {
        "reconfigurations": str(len(changes)),
        "reconfigurations that failed": str(len(summary["reconfigurations_failed"])),
        "mean duration of a reconfiguration": _number(statistics.fmean(durations) if durations else None, "s"),
        "control periods missed": _share(control["periods_missed"]),
        "simulated / wall time": _number(summary["real_time_factor"]),
    }


def _adaptation_column(run: Mapping[str, Any]) -> dict[str, str]:
    decisions, spans = run["decisions"], run["reconfiguration_s"]
    rows = {"outcome": run["outcome"]} if run["outcome"] else {}
    rows["duration"] = _number(run["duration_s"], "s")
    for function, shares in run["configurations"].items():
        for name, share in shares.items():
            changing = f", {share['changing_s']:.2f} s of it changing" if share["changing_s"] else ""
            rows[f"{function}: {name}"] = f"{share['s']:.2f} s{changing}"
    states = ", ".join(f"{count} {state}" for state, count in decisions["by_state"].items())
    rows["decisions"] = f"{decisions['count']}{f': {states}' if states else ''}"
    rows |= {f"decisions by {trigger}": str(count) for trigger, count in decisions["by_trigger"].items()}
    rows |= {
        "degraded decisions": str(decisions["degraded"]),
        "reconfigurations": str(len(run["reconfigurations"])),
        "reconfigurations that failed": str(len(run["reconfigurations_failed"])),
        "duration of a reconfiguration, mean": _number(spans["mean"], "s"),
        "duration of a reconfiguration, longest": _number(spans["max"], "s"),
    }
    for name, quality in run["qualities"].items():
        rows[f"mean {name}, as observed"] = _number(quality["mean"])
        if quality["limit"] is not None:
            rows[f"{name} {quality['violated']} {quality['limit']:g}"] = _number(quality["violated_s"], "s")
        if quality["stale_s"]:
            rows[f"{name} could not be observed"] = _number(quality["stale_s"], "s")
    for name, failures in run["components"].items():
        rows[f"failures of {name}"] = ", ".join(map(_failure, failures))
    return rows


def _failure(failure: Mapping[str, float | None]) -> str:
    again = failure["recovered_s"]
    return f"at {failure['stamp_s']:.2f} s, {'not back' if again is None else f'back after {again:.2f} s'}"


def _violations(found: Sequence[Mapping[str, Any]] | None) -> str:
    """Return how many violations there were, and how long it took on average until relief."""
    if not found:
        return UNKNOWN if found is None else "0"
    times = [violation["relief_s"] for violation in found if violation["relief_s"] is not None]
    last = ", the last one to the end" if len(times) < len(found) else ""
    return f"{len(found)}{f', relief after {statistics.fmean(times):.2f} s' if times else ''}{last}"


def _contingency(told: Mapping[str, Any]) -> str:
    parts = [f"clutter {told['clutter']}"] if told["clutter"] else []
    parts += [f"power x {told['power']:g}"] if told["power"] != 1.0 else []
    parts += [told["component"]] if told["component"] else []
    return ", ".join(parts) or "none"


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _number(value: float | None, unit: str = "") -> str:
    return UNKNOWN if value is None else f"{value:.2f} {unit}".strip()


def _share(value: float | None) -> str:
    return UNKNOWN if value is None else f"{value:.2%}"
