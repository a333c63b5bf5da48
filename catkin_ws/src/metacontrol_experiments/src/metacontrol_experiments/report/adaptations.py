"""What the managers did: reconfigurations, violations and their relief, and what the meta-controller costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.report.missions import QUALITIES, Mission, of_manager
from metacontrol_experiments.report.statistics import Estimate, mean, ratio

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

SPANS = ("detect_s", "decide_s", "execute_s")
"""Of a reconfiguration: from its cause to the first report, to the decision, to its end."""


@dataclass(frozen=True)
class Relief:
    """Violations of a limit by a manager's missions.

    Attributes:
        per_mission: number of violations.
        seconds: from a violation's start to relief; None without a violation. One that lasts to the end of its mission
            counts until then.
        violations: how many there were.
        unrelieved: how many of them lasted to the end of their missions.
    """

    per_mission: Estimate
    seconds: Estimate | None
    violations: int
    unrelieved: int


@dataclass(frozen=True)
class Activity:
    """What a manager did in its missions.

    Attributes:
        reconfigurations: per mission; None where no summary tells them.
        failed: reconfigurations that failed, of all missions.
        duration: of a mission, s.
        collisions: per mission; None where they are not known.
        relief: by quality; without one of which no summary tells violations.
    """

    reconfigurations: Estimate | None
    failed: int
    duration: Estimate | None
    collisions: Estimate | None
    relief: Mapping[str, Relief]


@dataclass(frozen=True)
class Cost:
    """What a node costs, over missions that tell it.

    Attributes:
        cpu: mean in per cent of a core; None where it is not known.
        memory: largest, MB; None where it is not known.
    """

    cpu: Estimate | None
    memory: Estimate | None


def activity(missions: Iterable[Mission], manager: str) -> Activity:
    """Return what a manager did in those of the missions that are its own."""
    own = of_manager(missions, manager)
    told = [mission.summary for mission in own if mission.summary]
    return Activity(
        reconfigurations=_mean([len(summary["reconfigurations"]) for summary in told if "reconfigurations" in summary]),
        failed=sum(len(summary.get("reconfigurations_failed", ())) for summary in told),
        duration=_mean([mission.figures["duration_s"] for mission in own]),
        collisions=_mean([summary.get("collisions") for summary in told]),
        relief={
            quality: found for quality in QUALITIES if (found := _relief([*map(_timed, own)], quality)) is not None
        },
    )


def spans(missions: Iterable[Mission], manager: str) -> dict[str, dict[str, list[float]]]:
    """Return the durations (s) of a manager's reconfigurations: kind of trigger -> span -> values.

    The kind is `quality` (a limit was violated), `component` (one failed) or what else the trigger says.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for mission in of_manager(missions, manager):
        for change in mission.summary.get("reconfigurations", ()):
            kind = str(change.get("trigger", "")).partition(":")[0] or "other"
            values = found.setdefault("quality" if kind == "qa" else kind, {span: [] for span in SPANS})
            for span in SPANS:
                if change.get(span) is not None:
                    values[span].append(float(change[span]))
    return dict(sorted(found.items()))


def costs(missions: Iterable[Mission], manager: str) -> dict[str, Cost]:
    """Return what each node costs that a manager's missions tell of, by its name; empty without ROS."""
    told = [mission.summary.get("cost") or {} for mission in of_manager(missions, manager)]
    return {
        node: Cost(
            _mean([cost.get(node, {}).get("cpu_percent_mean") for cost in told]),
            _mean([cost.get(node, {}).get("memory_mb_max") for cost in told]),
        )
        for node in sorted({node for cost in told for node in cost})
    }


def total_cost(missions: Iterable[Mission], manager: str) -> Cost:
    """Return what all nodes that a mission tells of cost together."""
    told = [list(cost.values()) for mission in of_manager(missions, manager) if (cost := mission.summary.get("cost"))]
    sums = {
        figure: [
            sum(values) if (values := [node[figure] for node in nodes if node.get(figure) is not None]) else None
            for nodes in told
        ]
        for figure in ("cpu_percent_mean", "memory_mb_max")
    }
    return Cost(_mean(sums["cpu_percent_mean"]), _mean(sums["memory_mb_max"]))


def _relief(told: Sequence[tuple[Mapping[str, Any], float]], quality: str) -> Relief | None:
    """Return the violations of a limit; None where no summary tells them.

    Args:
        told: summary and duration (s) of each mission.
        quality: whose limit.
    """
    counts, sums, unrelieved = [], [], 0
    for summary, duration in told:
        violations = summary.get("violations", {}).get(quality)
        if violations is None:
            continue
        times = [violation["relief_s"] for violation in violations]
        lasting = [duration - entry["stamp_s"] for entry, time in zip(violations, times, strict=True) if time is None]
        counts.append(float(len(violations)))
        sums.append(sum(time for time in times if time is not None) + sum(lasting))
        unrelieved += len(lasting)
    if not counts:
        return None
    return Relief(mean(counts), ratio(sums, counts), int(sum(counts)), unrelieved)


def _timed(mission: Mission) -> tuple[Mapping[str, Any], float]:
    return mission.summary, float(mission.figures["duration_s"] or 0.0)


def _mean(values: Sequence[float | None]) -> Estimate | None:
    known = [float(value) for value in values if value is not None]
    return mean(known) if known else None
