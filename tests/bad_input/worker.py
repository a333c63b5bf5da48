"""A process that makes trials: whatever an input does to it, the soak goes on."""

from __future__ import annotations

import gc
import os
import resource
import signal
import socket
import sys
import tempfile
import traceback
from pathlib import Path
from typing import NoReturn

from bad_input.trial import BROKEN, LARGEST, LAST, HangError, Verdict, made, tried

_FILES = 64_000_000
"""Bytes of the largest file that an input may have written."""


def main() -> None:
    """Make the trials of a seed that numbers on the standard input ask for.

    Before each trial, its number goes to the standard output; after it, a line of what came of it. Nothing else is
    said, but why the process itself ends before its time.
    """
    seed = int(sys.argv[1])
    answers, last_words = os.fdopen(os.dup(1), "w", buffering=1), os.fdopen(os.dup(2), "w")
    sys.excepthook = lambda *error: traceback.print_exception(*error, file=last_words)
    silence()
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None) as folder:
        os.chdir(folder)
        warm_up(Path(folder))
        limit_memory()
        for line in sys.stdin:
            first, last = map(int, line.split())
            for number in range(first, last):
                answers.write(f"{number}\n")
                subject, data = made(seed, number)
                signal.setitimer(signal.ITIMER_VIRTUAL, LAST)  # ends the process, also in native code
                try:
                    verdict = tried(subject, data, Path(folder))
                except (Exception, HangError) as error:  # outside of what takes the input
                    verdict = Verdict(BROKEN, f"a trial fails: {error!r}"[:300])
                signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)  # the next input may take its time to make
                told = (verdict.outcome, subject.name, f"{verdict.cpu:.4f}", str(verdict.memory), verdict.problem)
                answers.write("\t".join(" ".join(text.split()) for text in told) + "\n")


def silence() -> None:
    """Say nothing, whatever is logged or printed, and reach nobody: names of hosts are not looked up."""
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    socket.getaddrinfo = _nobody  # type: ignore[assignment]
    socket.gethostbyname = _nobody  # type: ignore[assignment]


def _nobody(*_: object, **__: object) -> NoReturn:
    raise socket.gaierror(socket.EAI_NONAME, "no names are looked up")


def warm_up(folder: Path) -> None:
    """Have everybody take what is good, so that all is imported and kept before anything is measured."""
    from bad_input.subjects import subjects

    for subject in subjects():
        for seed in subject.seeds:  # type: ignore[attr-defined]
            tried(subject, seed, folder)
    gc.collect()
    gc.freeze()


def limit_memory() -> None:
    """Let the process grow by what an input may need and no more, and write no large files."""
    with open("/proc/self/statm", encoding="ascii") as file:
        size = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + LARGEST, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_FILES, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
