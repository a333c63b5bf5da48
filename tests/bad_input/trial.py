"""One trial: a bad input, who takes it, and what came of that."""

from __future__ import annotations

import shutil
import signal
import sys
import time
import traceback
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, NoReturn

from bad_input.subjects import Subject, subjects

if TYPE_CHECKING:
    from types import TracebackType

LONGEST = 1.0
"""s of CPU that an input may take."""
LARGEST = 500_000_000
"""Bytes by which an input may make the process grow."""
DEADLY = 5
"""s of CPU after which a try is ended."""
_AGAIN = 2
"""Times that a slow input is tried again: a busy machine makes one slow."""
LAST = 4 * DEADLY
"""s of CPU after which the process of a worker is ended: more than all tries of an input take."""
LONGEST_REFUSAL = 4000
"""Characters of a refusal."""

ACCEPTED, REFUSED, BROKEN = "accepted", "refused", "broken"


class HangError(BaseException):
    """An input takes for ever. No reader that catches every Exception may take it for a refusal."""


@dataclass(frozen=True)
class Verdict:
    """What came of an input.

    Attributes:
        outcome: accepted, refused or broken.
        problem: what is broken, in one line that is the same for inputs that break the same.
        detail: the whole of it.
        cpu: time that it took, s.
        memory: bytes by which the process grew meanwhile.
    """

    outcome: str
    problem: str = ""
    detail: str = ""
    cpu: float = 0.0
    memory: int = 0


def made(seed: int, number: int) -> tuple[Subject, bytes]:
    """Return the input of a number, and who takes it: always the same."""
    rng = Random(seed * 1_000_000_007 + number)
    found = subjects()
    subject = rng.choices(found, cum_weights=_weights())[0]
    return subject, subject.mutated(rng)


@cache
def _weights() -> list[float]:
    return list(accumulate(subject.share for subject in subjects()))


def tried(subject: Subject, data: bytes, scratch: Path) -> Verdict:
    """Let a subject take an input, in an empty folder."""
    verdict = _measured(subject, data, scratch)
    for _ in range(_AGAIN):
        if verdict.outcome == BROKEN or verdict.cpu <= LONGEST:
            return verdict
        verdict = min(verdict, _measured(subject, data, scratch), key=lambda one: one.cpu)
    if verdict.cpu > LONGEST:
        return Verdict(BROKEN, f"takes more than {LONGEST:g} s", f"{verdict.cpu:.2f} s", verdict.cpu, verdict.memory)
    return verdict


def _measured(subject: Subject, data: bytes, scratch: Path) -> Verdict:
    folder = scratch / "input"
    folder.mkdir(parents=True)
    before = _peak(reset=True)
    begin = time.process_time()
    outcome, problem, detail = ACCEPTED, "", ""
    before_hang = signal.signal(signal.SIGPROF, _end_hang)
    signal.setitimer(signal.ITIMER_PROF, DEADLY)
    try:
        refusal = subject.run(data, folder)
        if refusal is not None:
            outcome, detail = REFUSED, refusal
            problem = subject.fault_of(refusal)
    except MemoryError as error:
        problem, detail = f"needs more than {LARGEST / 1e6:g} MB", _text(error)
    except (Exception, HangError) as error:
        problem, detail = _signature(error), _text(error)
    except SystemExit as error:
        problem, detail = "ends the process", _text(error)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before_hang)
    cpu = time.process_time() - begin
    grown = max(0, _peak() - before)
    shutil.rmtree(folder, ignore_errors=True)
    if not problem and grown > LARGEST:
        problem = f"needs more than {LARGEST / 1e6:g} MB"
    return Verdict(BROKEN if problem else outcome, problem, detail, cpu, grown)


def _end_hang(*_: object) -> NoReturn:
    raise HangError


def _signature(error: BaseException) -> str:
    """Return error and place in the product, in one line."""
    frame, place = error.__traceback__, "outside"
    root = f"{Path('catkin_ws/src')}/"
    while frame is not None:
        file = frame.tb_frame.f_code.co_filename
        if root in file:
            place = f"{file.rpartition(root)[2]}:{_name(frame)}"
        frame = frame.tb_next
    return f"{type(error).__name__} in {place}"


def _name(frame: TracebackType) -> str:
    return frame.tb_frame.f_code.co_qualname if sys.version_info >= (3, 11) else frame.tb_frame.f_code.co_name


def _text(error: BaseException) -> str:
    lines = traceback.format_exception(error, limit=-12)
    return "".join(lines)[-6000:]


def _peak(*, reset: bool = False) -> int:
    """Return the largest resident size since the last reset, bytes."""
    if reset:
        try:
            Path("/proc/self/clear_refs").write_text("5")
        except OSError:
            return _status("VmHWM")
        return _status("VmRSS")
    return _status("VmHWM")


def _status(name: str) -> int:
    with open("/proc/self/status", encoding="ascii", errors="replace") as lines:
        for line in lines:
            if line.startswith(name):
                return int(line.split()[1]) * 1024
    return 0
