"""Drives a run of a campaign on ROS: by `metacontrol run`, with a master of its own on a free port."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metacontrol_experiments.campaign.progress import LONGEST_LOG, Attempt, Status
from metacontrol_experiments.mission.settings import BAG_NAME, ROS, SUMMARY_NAME

if TYPE_CHECKING:
    from collections.abc import Sequence

    from metacontrol_experiments.campaign.matrix import Run
    from metacontrol_experiments.mission.ground import Ground

_OWN = ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")
"""It ends what it started when it is interrupted, and is interrupted when this process dies."""
_GRACE_S = 60.0
_CONSOLE = Path("log", "console.log")


def drive_on_ros(run: Run, deadline: float, ground: Ground) -> tuple[Attempt, dict[str, Any]]:
    """Drive a run; return how that went, and its summary with the log of the console and the bag.

    Args:
        run: what is asked for.
        deadline: wall s for it.
        ground: where it is driven.
    """
    with tempfile.TemporaryDirectory(prefix="campaign-") as folder:
        output = Path(folder, "mission")
        attempt, summary = drive_command(_command(run, ground, output), output, deadline)
        if attempt.status is not Status.DONE:
            return attempt, {}
        return attempt, {"summary": summary, "log": _end_of(output / _CONSOLE), "bag": (output / BAG_NAME).read_bytes()}


def drive_command(command: Sequence[str], output: Path, deadline: float) -> tuple[Attempt, dict[str, Any]]:
    """Run `metacontrol run`; return how that went, and the summary.

    Args:
        command: its words.
        output: the folder that it is given.
        deadline: wall s for it.
    """
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="campaign-") as folder:
        said = Path(folder, "said.log")
        with said.open("wb") as log:
            process = subprocess.Popen([*_OWN, *command], stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            in_time = _ends(process, deadline)
        finally:  # also where this process is interrupted
            _end(process)
        wall_s = round(time.monotonic() - began, 3)
        summary, console = output / SUMMARY_NAME, _end_of(output / _CONSOLE)
        if in_time and process.returncode in (0, 1) and summary.exists():
            return Attempt(Status.DONE, wall_s), json.loads(summary.read_bytes())
        told = _end_of(said)
        if not in_time:
            return Attempt(Status.HUNG, wall_s, f"no end within {deadline:g} s of wall time", told + console), {}
        last = (told.strip().splitlines() or ["it said nothing"])[-1]
        problem = f"metacontrol run ended with status {process.returncode}: {last}"
        return Attempt(Status.CRASHED, wall_s, problem, told + console), {}


def _command(run: Run, ground: Ground, output: Path) -> list[str]:
    asked = {
        "--manager": run.plug_in,
        "--route": run.route,
        "--initial-configuration": run.initial_configuration,
        "--seed": run.seed,
        "--timeout": run.timeout,
        "--failure": "none",
        "--output": output,
    }
    if run.parameters:
        asked["--parameters"] = run.parameters
    files = {"--world": ground.world, "--routes": ground.routes}
    options = [*asked.items(), *(("--contingency", text) for text in run.contingencies)]
    options += [(option, path) for option, path in files.items() if path is not None]
    words = [str(word) for option in options for word in option]
    words += [] if run.environment else ["--no-environment"]
    words += [] if run.spares else ["--no-spares"]
    return [sys.executable, "-m", "metacontrol_experiments.cli.main", "run", "--engine", ROS, "--quiet", *words]


def _end(process: subprocess.Popen[bytes]) -> None:
    """Have a process end, with what it started."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        if not _ends(process, _GRACE_S):
            process.kill()
            process.wait()


def _ends(process: subprocess.Popen[bytes], deadline: float) -> bool:
    """Tell whether a process ends in time."""
    try:
        process.wait(deadline)
    except subprocess.TimeoutExpired:
        return False
    return True


def _end_of(path: Path) -> str:
    return path.read_bytes()[-LONGEST_LOG:].decode(errors="replace") if path.exists() else ""
