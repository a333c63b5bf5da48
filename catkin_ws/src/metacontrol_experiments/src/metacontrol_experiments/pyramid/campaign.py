"""A campaign of D1: which missions a file asks for, the table of what became of them, and the levels of designs.

The levels of a design are measured where it builds and nothing goes wrong: `duration` in s and `placement_error`, the
largest distance of a block from its slot in m, are means over the missions in which the pyramid stands; `success` is
the share of these missions; `performance` is the mean of the shortest time that any design took with the same seed by
the design's own, 0 without success.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from statistics import fmean, median, stdev
from typing import TYPE_CHECKING, Any

from ros_model.project.schema_check import violations

from metacontrol_experiments.campaign.matrix import CampaignError, check_count
from metacontrol_experiments.managers.manager import MROS, NONE
from metacontrol_experiments.pyramid.scenarios import MANIPULATION, TITLES, UNDISTURBED

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_SCENARIO = {"type": "integer", "enum": list(TITLES), "title": f"one of {', '.join(map(str, TITLES))}"}
_MANAGER = {"type": "string", "enum": [MROS, NONE], "title": f"{MROS} or {NONE}"}
_SCHEMA = {
    "type": "object",
    "title": "a mapping with the keys mission, scenarios, seeds and managers",
    "required": ["mission", "scenarios", "seeds", "managers"],
    "additionalProperties": False,
    "properties": {
        "mission": {"enum": [MANIPULATION], "title": MANIPULATION},
        "scenarios": {"type": "array", "minItems": 1, "items": _SCENARIO, "title": "a list"},
        "seeds": {"type": "integer", "minimum": 1, "title": "the number of seeds, from 1 on"},
        "initial_configurations": {
            "type": "array",
            "minItems": 1,
            "items": {"type": "string", "minLength": 1, "title": "names with commas between them"},
            "title": "a list",
        },
        "managers": {"type": "array", "minItems": 1, "items": _MANAGER, "title": "a list"},
    },
}
_TEXT = {"type": "string", "title": "text"}
_FLAG = {"type": "boolean", "title": "true or false"}
_NUMBER = {"type": "number", "title": "a number"}
_NUMBER_OR_NULL = {"anyOf": [_NUMBER, {"const": None}], "title": "a number, or null"}
_STRIKE = {
    "type": "object",
    "title": "a strike",
    "required": ["name", "recover_s"],
    "properties": {
        "name": _TEXT,
        "recover_s": _NUMBER_OR_NULL,
    },
}
_CAUSES = {
    "light": "the light changes",
    "obstacle": "an arm stops",
    "component": "a driver dies",
    "release": "an arm is free",
}


@dataclass(frozen=True)
class PyramidRun:
    """One mission of a campaign.

    Attributes:
        scenario: number.
        seed: of everything that is drawn.
        manager: mros or none.
        configurations: deployed at the start, by commas; empty: as the scenario has it.
    """

    scenario: int
    seed: int
    manager: str
    configurations: str = ""

    @property
    def name(self) -> str:
        """Its name, and its folder below that of the campaign's runs."""
        given = f"_{self.configurations.replace(',', '-')}" if self.configurations else ""
        return f"scenario{self.scenario}_seed{self.seed:03d}_{self.manager}{given}"

    @property
    def arguments(self) -> list[str]:
        """What `metacontrol run` is given for it."""
        baseline = ["--no-metacontrol"] if self.manager == NONE else []
        given = ["--initial-configuration", self.configurations] if self.configurations else []
        return [
            "--mission",
            MANIPULATION,
            "--scenario",
            str(self.scenario),
            "--seed",
            str(self.seed),
            *given,
            *baseline,
        ]


_COLUMNS = {
    "success": _FLAG,
    "placed": _NUMBER,
    "duration_s": {**_NUMBER, "minimum": 0, "title": "a number, 0 or more"},
    "placed_error_mm": _NUMBER,
    "moved_mm": _NUMBER,
    "placed_lost": _NUMBER,
    "stands_still": _FLAG,
    "real_time_factor": _NUMBER_OR_NULL,
    "outcome": _TEXT,
    "reason": _TEXT,
    "commit": _TEXT,
}
"""What a table of missions has of each summary."""
_SUMMARY = {
    "type": "object",
    "title": "the summary of a mission",
    "required": [*_COLUMNS, "strikes"],
    "properties": {**_COLUMNS, "strikes": {"type": "array", "items": _STRIKE, "title": "a list of strikes"}},
}


def asks_for_pyramids(content: Any) -> bool:
    """Return whether the content of a campaign's file is about D1."""
    return isinstance(content, dict) and content.get("mission") == MANIPULATION


def parse_pyramids(content: Any, where: str) -> tuple[PyramidRun, ...]:
    """Return the missions of a file, seed by seed, so that an early end leaves some of each kind.

    Raises:
        CampaignError: it makes no sense.
    """
    for violation in violations(content, _SCHEMA):
        raise CampaignError(f"{where}: {violation}")
    scenarios, managers = (tuple(dict.fromkeys(content[key])) for key in ("scenarios", "managers"))
    given = tuple(dict.fromkeys(content.get("initial_configurations", [""])))
    check_count(content["seeds"] * len(scenarios) * len(given) * len(managers), f"{where}: seeds")
    return tuple(
        PyramidRun(scenario, seed, manager, configurations)
        for seed in range(1, content["seeds"] + 1)
        for scenario in scenarios
        for configurations in given
        for manager in managers
    )


def read_summary(text: str, where: str) -> dict[str, Any]:
    """Return the summary of a mission, as its file has it.

    Raises:
        CampaignError: it is none.
    """
    try:
        summary: dict[str, Any] = json.loads(text)
        for violation in violations(summary, _SUMMARY):
            raise ValueError(str(violation))
        json.dumps(summary, ensure_ascii=False).encode()  # half of a surrogate pair is no text
    except (ValueError, RecursionError) as error:
        raise CampaignError(f"{where}: is no summary of a mission ({error}): delete it, and drive it again") from error
    return summary


def report(summaries: Mapping[PyramidRun, Mapping[str, Any]]) -> str:
    """Return the tables of a campaign in Markdown: success, duration and accuracy, and how fast it recovers."""
    from metacontrol_experiments.report.statistics import rate  # scipy takes a while to import

    groups: dict[tuple[int, str, str], list[Mapping[str, Any]]] = {}
    for run, summary in sorted(summaries.items(), key=lambda item: _order(item[0])):
        groups.setdefault((run.scenario, run.configurations, run.manager), []).append(summary)
    lines = [
        "| scenario | manager | missions | success (95 %) | duration, median | largest error of a block | "
        "placed blocks lost | simulated / wall time |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (scenario, configurations, manager), missions in groups.items():
        share = rate([bool(mission["success"]) for mission in missions])
        met = f"{share.value:.0%} ({share.low:.0%} to {share.high:.0%})"
        well = [mission for mission in missions if mission["success"]]
        durations = f"{median(mission['duration_s'] for mission in well):.0f} s" if well else "-"
        error = f"{max(mission['placed_error_mm'] for mission in well):.1f} mm" if well else "-"
        lost = sum(mission["placed_lost"] for mission in missions)
        factors = [m["real_time_factor"] for m in missions if m["real_time_factor"] is not None]
        factor = f"{median(factors):.2f}" if factors else "-"
        title = f"{scenario}: {TITLES[scenario]}" + (f", `{configurations}`" if configurations else "")
        lines.append(f"| {title} | `{manager}` | {len(missions)} | {met} | {durations} | {error} | {lost} | {factor} |")
    adapted = [mission for (_, _, manager), missions in groups.items() if manager == MROS for mission in missions]
    recovered = {what: times for kind, what in _CAUSES.items() if (times := _recoveries(adapted, kind))}
    if recovered:
        lines += ["", "| cause | changes | cause to next motion, median | largest |", "|---|---|---|---|"]
    for what, times in recovered.items():
        lines.append(f"| {what} | {len(times)} | {median(times):.1f} s | {max(times):.1f} s |")
    return "\n".join(lines) + "\n"


def rows(summaries: Mapping[PyramidRun, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a table of all missions: one row for each, in the order of scenarios."""
    return [
        {
            "scenario": run.scenario,
            "seed": run.seed,
            "manager": run.manager,
            "initial_configurations": run.configurations,
            **{name: summary[name] for name in _COLUMNS},
            "recover_s": " ".join(f"{s['name']}={s['recover_s']}" for s in summary["strikes"]),
        }
        for run, summary in sorted(summaries.items(), key=lambda item: _order(item[0]))
    ]


def levels(summaries: Mapping[PyramidRun, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the measured levels of designs, a row for each, as a table of expected levels (`qa`) has them.

    A design is the first of the configurations with which a mission without disturbance began; none if there is none.
    """
    fastest: dict[int, float] = {}
    of_design: dict[str, list[tuple[int, Mapping[str, Any]]]] = {}
    for run, summary in sorted(summaries.items(), key=lambda item: _order(item[0])):
        if run.scenario == UNDISTURBED and run.configurations:
            of_design.setdefault(run.configurations.split(",")[0], []).append((run.seed, summary))
            if summary["success"]:
                fastest[run.seed] = min(summary["duration_s"], fastest.get(run.seed, summary["duration_s"]))
    found = []
    for design, missions in of_design.items():
        well = [mission for _, mission in missions if mission["success"]]
        shares = [fastest[seed] / (m["duration_s"] or math.inf) if m["success"] else 0.0 for seed, m in missions]
        durations = [mission["duration_s"] for mission in well]
        found.append(
            {
                "name": design,
                "performance": round(fmean(shares), 3),
                "duration": round(fmean(durations), 1) if well else "",
                "placement_error": round(fmean(m["placed_error_mm"] for m in well) / 1000.0, 5) if well else "",
                "success": round(len(well) / len(missions), 3),
                "source": "measured",
                "performance_spread": round(stdev(shares), 3) if len(shares) > 1 else "",
                "duration_spread": round(stdev(durations), 1) if len(durations) > 1 else "",
                "missions": len(missions),
                "seeds": f"{min(seed for seed, _ in missions)}-{max(seed for seed, _ in missions)}",
            }
        )
    return found


def _order(run: PyramidRun) -> tuple[int, str, str, int]:
    return run.scenario, run.configurations, run.manager, run.seed


def _recoveries(missions: Iterable[Mapping[str, Any]], kind: str) -> list[float]:
    strikes = (strike for mission in missions for strike in mission["strikes"])
    return [s["recover_s"] for s in strikes if s["name"].startswith(f"{kind}:") and s["recover_s"] is not None]
