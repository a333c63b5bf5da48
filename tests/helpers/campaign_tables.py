"""Synthetic results of campaigns: missions as their table has them, without driving any."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from metacontrol_experiments.campaign.matrix import Run
from metacontrol_experiments.campaign.progress import Attempt, Result, Status, row
from metacontrol_experiments.io.campaign_folder import write_result, write_table
from metacontrol_experiments.mission.settings import LOG_NAME
from metacontrol_experiments.report.missions import Mission, missions_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

PROVENANCE = {"commit": "c" * 40, "host": "somewhere", "ended": "2026-01-02T03:04:05+00:00", "versions": "python 3"}

LOG = """3.00 MISSION_START east mission=M route=east
3.00 PERTURBATION clutter:7 share=0.0000 places=1.0,2.0
3.10 0.1 0.2 0.3 1.0 0.0 0.0 0.25 0.5
3.20 0.1 0.2 0.3 1.0 0.0 0.0 0.75 0.5
4.00 PERTURBATION power:1.4 share=0.6000
4.10 slow RECONFIGURING
4.20 0.1 0.2 0.3 1.0 0.0 0.0 0.1 0.9
5.10 slow STABLE
5.15 lidar started again
5.20 fast RECONFIGURING
6.00 MISSION_END east outcome=reached reason=goal reached
"""
"""Of a mission in lockstep, with all kinds of lines."""


def pyramid_summary(success: bool, *times: float | None) -> dict[str, Any]:
    """Return the summary of a mission with pyramids, the lights of which went out; times in s until it recovered."""
    return {
        "success": success,
        "placed": 6,
        "duration_s": 70.0,
        "placed_error_mm": 1.2,
        "moved_mm": 0.0,
        "placed_lost": 0,
        "stands_still": True,
        "real_time_factor": 1.0,
        "outcome": "reached",
        "reason": "the pyramid stands",
        "commit": "abc",
        "strikes": [{"name": "light:0.04", "recover_s": time} for time in times],
    }


def result(manager: str = "none", repeat: int = 1, **told: Any) -> Result:
    """Return a mission of a campaign.

    Args:
        manager: what adapts.
        repeat: of the cell; it is the seed, too.
        told: fields of its run; `safety` and `energy`: shares of time above the thresholds; `success`, `reached`,
            `duration`; `status`, `problem`; `summary`: further keys; `provenance`: further keys.
    """
    contingencies = [f"clutter:{told.get('clutter', 0)}@time:0"] if told.get("clutter") else []
    contingencies += [f"power:{told['power']}"] if told.get("power", 1.0) != 1.0 else []
    contingencies += told.get("failures", ())
    run = Run(
        part=told.get("part", "main"),
        route=told.get("route", "east"),
        initial_configuration=told.get("start", "slow"),
        clutter=told.get("clutter", 0),
        power=told.get("power", 1.0),
        failure=told.get("failure", "none"),
        contingencies=tuple(contingencies),
        manager=manager,
        repeat=repeat,
        seed=told.get("seed", repeat),
        engine=told.get("engine", "lockstep"),
        timeout=told.get("timeout", 250.0),
    )
    status = told.get("status", Status.DONE)
    provenance = PROVENANCE | told.get("provenance", {})
    attempt = Attempt(status, 1.0, told.get("problem", ""))
    if status is not Status.DONE:
        return Result(run, (attempt,), None, provenance)
    reached = told.get("reached", True)
    summary = {
        "outcome": "reached" if reached else "timeout",
        "success": told.get("success", True),
        "goal_reached": reached,
        "duration_s": told.get("duration", 40.0),
        "collisions": 0,
        "time_above_threshold": {"safety": told.get("safety", 0.0), "energy": told.get("energy", 0.0)},
        "reconfigurations": [],
        "reconfigurations_failed": [],
        "thresholds": {"safety": 0.6, "energy": 0.62},
        "cost": {},
        "violations": {"safety": [], "energy": []},
        "violation_places": {"cell_m": 0.5, "safety": [], "energy": []},
    }
    return Result(run, (attempt,), summary | told.get("summary", {}), provenance)


def change(
    trigger: str = "qa:energy", detect: float = 0.1, decide: float = 0.2, execute: float = 1.0
) -> dict[str, Any]:
    """Return a reconfiguration as a summary has it."""
    spans = {"detect_s": detect, "decide_s": decide, "execute_s": execute}
    return {"stamp_s": 5.0, "trigger": trigger, "from": "fast", "to": "slow", **spans, "degraded": False}


def violation(stamp: float, relief: float | None) -> dict[str, Any]:
    """Return a violation as a summary has it."""
    return {"stamp_s": stamp, "relief_s": relief, "above_s": 1.0, "pieces": 1}


def missions(results: Sequence[Result]) -> tuple[Mission, ...]:
    """Return the missions of results."""
    return missions_of([row(result) for result in results], "results.parquet")


def write(folder: Path, results: Sequence[Result], campaign: str = "", logs: dict[str, str] | None = None) -> Path:
    """Write the folder of a campaign, with the log of a run where it is given by the run's name; return its table."""
    for found in results:
        log = (logs or {}).get(found.run.name)
        if log is not None:
            write_result(folder, found, {LOG_NAME: log.encode()})
    named = {found.run.name: found for found in results}
    folder.mkdir(parents=True, exist_ok=True)
    return write_table(folder, [found.run for found in results], named, {"campaign": campaign})
