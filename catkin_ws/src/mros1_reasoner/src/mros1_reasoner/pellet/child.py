"""A child process that keeps Pellet ready in a JVM, and serves analyses over stdin and stdout.

Pellet is AGPL-3: it stays on this side of the process boundary. A frame is a line with the count of bytes that follow,
then JSON. Requests: {"op": "load", "name": ..., "ontology": N-Triples}, {"op": "forget", "name": ...},
{"op": "infer", "name": ..., "facts": [...], "properties": [...]}. Answers: {"ok": true, ...} or
{"ok": false, "inconsistent": bool, "message": text}. Run by `process.PelletReasoner`.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

PR_SET_PDEATHSIG = 1  # <linux/prctl.h>
MAX_FRAME = 256 * 1024 * 1024  # bytes; an ontology of 1,000 designs has about 1 MB
# -Xrs: signals stay with Python. The first stage of compilation is enough: analyses are rare and hardly get hot
# enough for the second. So measured at 30 designs, the JVM is ready in half the time, and compiles nothing while idle.
# The heap starts small, because the JVM keeps what it has once filled. Its figures for other programs go to no file.
JVM_OPTIONS = (
    *("-Xrs", "-XX:+UseSerialGC", "-XX:+ExitOnOutOfMemoryError", "-Xshare:auto", "-XX:TieredStopAtLevel=1"),
    *("-XX:NewSize=8m", "-XX:-UsePerfData", "-XX:+DisableExplicitGC"),
)
# Those of owlready2's jars that Pellet needs. Without a jar to write logs by, and without ARQ, Jena starts in half the
# time: log4j alone loads 600 classes.
JARS = ("pellet", "jena-core", "jena-iri", "aterm-java", "jgrapht", "slf4j-api", "xercesImpl")
RECORDING = "-XX:ArchiveClassesAtExit="
_ESCAPE = re.compile(r"\\(U[0-9A-Fa-f]{8}|.)")


def read_frame(stream: BinaryIO) -> dict[str, Any] | None:
    """Return the next message, or None at the end of the stream.

    Raises:
        ValueError: the stream does not hold a frame.
    """
    header = stream.readline(32)
    if not header:
        return None
    size = int(header)
    if not 0 <= size <= MAX_FRAME:
        raise ValueError(f"frame of {size} bytes")
    data = stream.read(size)
    if len(data) < size:
        return None
    message = json.loads(data)
    if not isinstance(message, dict):
        raise ValueError("a frame must hold an object")
    return message


def write_frame(stream: BinaryIO, message: dict[str, Any]) -> None:
    """Write a message and flush."""
    data = json.dumps(message, ensure_ascii=True, separators=(",", ":")).encode("ascii")
    stream.write(b"%d\n" % len(data) + data)
    stream.flush()


class Pellet:
    """Pellet in this process's JVM. It keeps ontologies by name, and adds the facts of each analysis to a copy."""

    def __init__(self, jvm: str, jars: list[str], heap_mb: int, options: Sequence[str] = ()) -> None:
        sys.modules["numpy"] = None  # type: ignore[assignment] # JPype would import it: 20 MB, 0.05 to 0.08 s
        import jpype

        memory = (f"-Xms{min(heap_mb, 16)}m", f"-Xmx{heap_mb}m")
        jpype.startJVM(jvm, *JVM_OPTIONS, *memory, *options, classpath=jars, convertStrings=False)
        self._knowledge_base = jpype.JClass("org.mindswap.pellet.KnowledgeBase")
        self._loader = jpype.JClass("org.mindswap.pellet.jena.graph.loader.DefaultGraphLoader")
        self._models = jpype.JClass("com.hp.hpl.jena.rdf.model.ModelFactory")
        self._reader = jpype.JClass("java.io.StringReader")
        self._singleton = jpype.JClass("java.util.Collections").singleton
        self._terms = jpype.JClass("org.mindswap.pellet.utils.ATermUtils")
        self._bases: dict[str, Any] = {}

    @staticmethod
    def end() -> None:
        """End the JVM in order, which writes what it has recorded."""
        import jpype

        jpype.shutdownJVM()

    def load(self, name: str, ontology: str) -> None:
        """Take an ontology in place of the one of that name; raise Inconsistent when it contradicts itself."""
        self.forget(name)
        model = self._models.createDefaultModel()
        model.read(self._reader(_ESCAPE.sub(_unescaped, ontology)), None, "N-TRIPLE")
        base = self._knowledge_base()
        loader = self._loader()
        loader.setKB(base)
        loader.load(self._singleton(model.getGraph()))
        self._ensure_consistent(base)
        self._bases[name] = base

    def forget(self, name: str) -> None:
        """Drop the ontology of that name, if there is one."""
        self._bases.pop(name, None)

    def infer(self, name: str, facts: list[list[str]], properties: list[str]) -> list[list[str]]:
        """Return the values of the properties, as [subject, property, value, datatype]."""
        if name not in self._bases:
            raise RuntimeError("no ontology is loaded")
        base = self._bases[name].copy()  # shares classes, properties and rules, copies what is said of individuals
        for subject, predicate, value, _ in facts:
            individual = self._terms.makeTermAppl(subject)
            if predicate == "http://www.w3.org/1999/02/22-rdf-syntax-ns#type":
                base.addIndividual(individual)
                base.addType(individual, self._terms.makeTermAppl(value))
        for subject, predicate, value, datatype in facts:
            if predicate == "http://www.w3.org/1999/02/22-rdf-syntax-ns#type":
                continue
            term = self._terms.makeTypedLiteral(value, datatype) if datatype else self._terms.makeTermAppl(value)
            if not base.addPropertyValue(self._terms.makeTermAppl(predicate), self._terms.makeTermAppl(subject), term):
                raise RuntimeError(
                    f"{subject} can't take {predicate} {value}: the property or an individual is unknown"
                )
        self._ensure_consistent(base)
        return [row for iri in properties for row in self._values(base, iri)]

    def _values(self, base: Any, name: str) -> list[list[str]]:
        rows = []
        for entry in base.getPropertyValues(self._terms.makeTermAppl(name)).entrySet():
            subject = str(entry.getKey().getName())
            for value in entry.getValue():
                if self._terms.isLiteral(value):
                    rows.append([subject, name, str(self._terms.getLiteralValue(value)), _datatype(self._terms, value)])
                else:
                    rows.append([subject, name, str(value.getName()), ""])
        return rows

    def _ensure_consistent(self, base: Any) -> None:
        if not base.isConsistent():
            raise InconsistentOntologyError(" ".join(str(base.getExplanation()).split()))


class InconsistentOntologyError(Exception):
    """The ontology contradicts itself."""


def _unescaped(match: re.Match[str]) -> str:
    """Return a character in place of its long escape, which Jena's own reader does not know."""
    return chr(int(match[1][1:], 16)) if len(match[1]) > 1 else match[0]


def _datatype(terms: Any, literal: Any) -> str:
    """Return the datatype's IRI; plain text has that of xsd:string."""
    name = str(terms.getLiteralDatatype(literal))
    return "http://www.w3.org/2001/XMLSchema#string" if name.endswith(("PlainLiteral", "#string")) or not name else name


def serve(pellet: Pellet, requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until their stream ends."""
    while (request := read_frame(requests)) is not None:
        try:
            if request["op"] == "load":
                pellet.load(request["name"], request["ontology"])
                answer: dict[str, Any] = {"ok": True}
            elif request["op"] == "forget":
                pellet.forget(request["name"])
                answer = {"ok": True}
            else:
                answer = {"ok": True, "values": pellet.infer(request["name"], request["facts"], request["properties"])}
        except InconsistentOntologyError as error:
            answer = {"ok": False, "inconsistent": True, "message": str(error)}
        except Exception as error:  # Java's exceptions have no other common class
            answer = {"ok": False, "inconsistent": False, "message": f"{type(error).__name__}: {error}"}
        write_frame(answers, answer)


def main() -> None:
    """Serve the parent process. Arguments: its pid, the JVM's library, the jars' folder, memory in MB, JVM options."""
    parent, jvm, folder, heap_mb = int(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), int(sys.argv[4])
    options = sys.argv[5:]
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        sys.exit(1)  # it died before the request above could hold
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal is for the parent, which ends this process
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what Java prints must not get between the frames
    jars = [str(path) for name in JARS for path in sorted(folder.glob(f"{name}-*.jar"))]
    try:
        pellet = Pellet(jvm, jars, heap_mb, options)
    except Exception as error:  # the parent tells its user
        write_frame(answers, {"ok": False, "inconsistent": False, "message": f"the JVM does not start: {error}"})
        sys.exit(1)
    write_frame(answers, {"ok": True})
    serve(pellet, sys.stdin.buffer, answers)
    answers.close()
    if any(option.startswith(RECORDING) for option in options):
        pellet.end()
    os._exit(0)  # a JVM that shuts down in order takes its time


if __name__ == "__main__":
    main()
