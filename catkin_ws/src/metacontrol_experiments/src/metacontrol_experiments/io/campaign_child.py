"""Drives missions in lockstep, one after the other, as a process that its parent can end.

Each line on stdin is a run; the answer is a line on stdout. What the mission says goes to stderr. The process ends when
stdin is closed, even in the middle of a mission: nobody would take the answer.
"""

from __future__ import annotations

import faulthandler
import gc
import json
import os
import queue
import sys
import threading
import traceback
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from metacontrol_experiments.io.lockstep_setup import Library


def main() -> None:
    """Answer until stdin is closed."""
    faulthandler.enable()  # a process that is ended for hanging tells where it hung
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # libraries print on stdout
    lines: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    while True:
        asked = json.loads(lines.get())
        try:
            answer = _drive(asked)
        except Exception as error:  # whatever it is, the parent is to know
            traceback.print_exc()
            answer = {"problem": " ".join(f"{type(error).__name__}: {error}".split())}
        sys.stderr.flush()
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
        if not gc.get_freeze_count():
            gc.collect()
            gc.freeze()  # what the missions have in common stays: the collector need not look through it in each


def _read(lines: queue.Queue[str]) -> None:
    for line in sys.stdin:
        lines.put(line)
    os._exit(0)


def _drive(asked: dict[str, Any]) -> dict[str, Any]:
    """Drive a mission, and return its summary and log."""
    import time

    from metacontrol_bags.metrics import summarise

    from metacontrol_experiments.campaign.matrix import Run, contingencies_of
    from metacontrol_experiments.io.code_version import current_commit
    from metacontrol_experiments.io.input_files import read_components, read_route, simulation_package
    from metacontrol_experiments.io.lockstep_setup import set_up
    from metacontrol_experiments.lockstep.recorder import with_wall_time
    from metacontrol_experiments.mission.settings import Settings

    began = time.monotonic()
    run = Run(**{**asked["run"], "contingencies": tuple(asked["run"]["contingencies"])})
    world, routes = (asked["ground"][name] and Path(asked["ground"][name]) for name in ("world", "routes"))
    package = simulation_package()
    settings = Settings(
        route=read_route(routes or package / "worlds" / "routes.yaml", run.route),
        output=Path(),  # nothing is written
        manager=run.plug_in,
        parameters=run.parameters,
        environment=run.environment,
        spares=run.spares,
        seed=run.seed,
        initial_configuration=run.initial_configuration,
        contingencies=contingencies_of(run),
        components=read_components(package / "models" / "metacontrol.yaml"),
        world=world,
        timeout_s=run.timeout,
        commit=current_commit(),
    )
    outcome = set_up(settings, _library()).run()
    record = with_wall_time(outcome.record, time.monotonic() - began)
    return {"summary": summarise(record), "log": outcome.log}


@cache
def _library() -> Library:
    """Return what the missions of this process have in common."""
    from metacontrol_experiments.io.lockstep_setup import Library

    return Library()


if __name__ == "__main__":
    main()
