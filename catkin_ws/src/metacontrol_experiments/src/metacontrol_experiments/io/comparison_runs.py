"""The missions of a comparison: each in a process of its own, all in one folder."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any

from node_kit.io.input_files import InputFileError, read_text

from metacontrol_experiments.io.processes import RunError, signals_as_interrupts
from metacontrol_experiments.mission.settings import SUMMARY_NAME

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


class ComparisonError(RuntimeError):
    """Missions cannot be compared; the message names file and remedy."""


def claim(folder: Path, options: Sequence[str]) -> None:
    """Reserve a folder for the missions of these options, by a file in it.

    Raises:
        ComparisonError: it holds those of others.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path, asked = folder / "options.txt", shlex.join(options) + "\n"
    try:
        held = read_text(path) if path.exists() else asked
    except InputFileError as error:
        raise ComparisonError(str(error)) from error
    if held != asked:
        said = held.strip() or "without options"
        raise ComparisonError(f"{folder} holds other missions ({said}): name another folder by --runs, or delete it")
    path.write_text(asked, encoding="utf-8")


def read_summary(path: Path) -> dict[str, Any]:
    """Read a mission's summary.

    Raises:
        ComparisonError: it is none.
    """
    try:
        content = json.loads(read_text(path))
    except InputFileError as error:
        raise ComparisonError(str(error)) from error
    except (ValueError, RecursionError) as error:
        raise ComparisonError(f"{path}: is no JSON ({error}); run its mission again") from error
    if not isinstance(content, dict) or "reconfigurations" not in content:
        raise ComparisonError(f"{path}: is no summary of a mission; run one")
    return content


def drive(engine: str, seed: int, output: Path, arguments: Sequence[str]) -> None:
    """Run a mission in a process of its own; its summary is in `output` then.

    Raises:
        RunError: it could not be run.
        KeyboardInterrupt: it was interrupted, and has ended.
    """
    command = [sys.executable, "-m", "metacontrol_experiments.cli.main", "run", "--quiet", *arguments]
    command += ["--engine", engine, "--seed", str(seed), "--output", str(output)]
    with (
        signals_as_interrupts(),
        # In a session of its own, so that it is interrupted once, from here, and has the time to end what it started.
        subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process,
    ):
        try:
            _, said = process.communicate()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    # Status 1 is a mission that did not reach its goal, or a program that broke.
    if process.returncode not in (0, 1) or not (output / SUMMARY_NAME).exists():
        last = (said.strip().splitlines() or ["it said nothing"])[-1]
        raise RunError(
            f"metacontrol run --engine {engine} --seed {seed} ended with status {process.returncode}: {last}"
        )
