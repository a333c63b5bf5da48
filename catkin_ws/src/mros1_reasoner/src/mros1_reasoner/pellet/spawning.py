"""Starts the process that keeps Pellet ready. This imports next to nothing, so that it can come before all else."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from mros1_reasoner.knowledge.reasoner import ReasonerError

HEAP_MB = 256  # of the JVM; with it, node and child stay below 500 MB
ARCHIVE = "mros1_reasoner.jsa"  # of Pellet's classes, beside the jars; `class_archive` makes it
NO_JAVA = "no Java runtime found: install openjdk-17-jre-headless, or set ~reasoner to rules"


class NoJavaError(ReasonerError):
    """There is no Java runtime."""


def find_jvm() -> Path:
    """Return the path of libjvm.so: of JAVA_HOME, else of the `java` on PATH.

    Raises:
        NoJavaError: there is none.
    """
    homes = [Path(os.environ["JAVA_HOME"])] if os.environ.get("JAVA_HOME") else []
    java = shutil.which("java")
    if java:
        homes.append(Path(java).resolve().parents[1])
    for home in homes:
        for library in (home / "lib/server/libjvm.so", home / "jre/lib/server/libjvm.so"):
            if library.is_file():
                return library
    raise NoJavaError(NO_JAVA)


def jar_folder() -> Path:
    """Return the folder of owlready2's jars.

    Raises:
        ReasonerError: JPype1 or the jars are missing.
    """
    if importlib.util.find_spec("jpype") is None:
        raise ReasonerError("the Python package JPype1 is missing: install requirements/python.txt")
    spec = importlib.util.find_spec("owlready2")
    folder = Path(spec.origin).parent / "pellet" if spec and spec.origin else Path()
    if not any(folder.glob("pellet-*.jar")):
        raise ReasonerError(f"owlready2's jars of Pellet are not in {folder}: install owlready2 0.49")
    return folder


def archive_options(jars: Path) -> list[str]:
    """Return the JVM's options for the archive of classes; it goes without one of another version or other jars."""
    archive = jars / ARCHIVE
    return [f"-XX:SharedArchiveFile={archive}"] if archive.is_file() else []


def spawn(
    jvm: Path, jars: Path, options: Sequence[str], heap_mb: int = HEAP_MB, *, is_quiet: bool = True
) -> subprocess.Popen[bytes]:
    """Start the process; it ends with the thread that calls this, at the latest.

    Args:
        jvm: path of libjvm.so.
        jars: folder of the jars.
        options: further ones of the JVM.
        heap_mb: memory of the JVM.
        is_quiet: whether what the process writes to its standard error is lost.

    Raises:
        OSError: it can't be started.
    """
    child = Path(__file__).with_name("child.py")
    process = subprocess.Popen(
        [*(sys.executable, "-P", str(child)), *(str(os.getpid()), str(jvm), str(jars), str(heap_mb), *options)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if is_quiet else None,
        bufsize=0,
    )
    os.set_blocking(process.stdin.fileno(), False)  # type: ignore[union-attr]
    return process


def spawn_early() -> subprocess.Popen[bytes] | None:
    """Start the process before it is known whether it is needed; None where it can't, which is told when it is."""
    try:
        jars = jar_folder()
        return spawn(find_jvm(), jars, archive_options(jars))
    except (ReasonerError, OSError):
        return None


def end(process: subprocess.Popen[bytes]) -> None:
    """End the process, and wait for that."""
    process.kill()
    for stream in (process.stdin, process.stdout):
        if stream:
            stream.close()
    process.wait()
