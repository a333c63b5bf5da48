"""Pellet in a child process that stays warm: started once, watched, and restarted when it dies or hangs."""

from __future__ import annotations

import json
import logging
import math
import os
import select
import subprocess
import time
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any, TypeVar

from mros1_reasoner.knowledge.reasoner import Assertion, InconsistentError, Reasoner, ReasonerError
from mros1_reasoner.knowledge.triples import Triple, TripleError, parse_ntriples, write_ntriples
from mros1_reasoner.pellet.equivalence import EquivalentIndividuals
from mros1_reasoner.pellet.owlready import OwlreadyReasoner
from mros1_reasoner.pellet.slices import SliceError, Slices
from mros1_reasoner.pellet.spawning import HEAP_MB, NoJavaError, archive_options, end, find_jvm, jar_folder, spawn

_log = logging.getLogger(__name__)

_Answer = TypeVar("_Answer")

START_DEADLINE = 20.0  # s, wall: a JVM and its jars, on a loaded machine
FIRST_RETRY, LONGEST_RETRY = 2.0, 300.0  # s, wall, until a lost child is tried again; meanwhile owlready2 calls Pellet
_WHOLE, _COMMON = "whole", "common"  # names of the child's ontologies


class ChildLostError(ReasonerError):
    """The child failed again after a restart."""


class PelletReasoner:
    """A Reasoner by Pellet in a warm child process.

    Not safe for use by several threads, and the thread that calls it first must live as long as it does:
    the kernel ends the child with the thread that started it.
    """

    def __init__(
        self, deadline: float = 20.0, heap_mb: int = HEAP_MB, child: subprocess.Popen[bytes] | None = None
    ) -> None:
        """Start the child; it loads while the caller continues.

        Args:
            deadline: s, wall, for an answer; a child that takes longer is replaced.
            heap_mb: memory of the JVM; a child that needs more ends, and is replaced.
            child: one that has been started already.

        Raises:
            NoJavaError: there is no Java runtime.
            ReasonerError: JPype1 or owlready2's jars are missing.
        """
        self._deadline, self._heap_mb = deadline, heap_mb
        self._jvm = find_jvm()
        self._jars = jar_folder()
        self._triples: list[Triple] = []
        self._loaded: dict[str, str] = {}  # what the child has, by name
        self._equivalent: EquivalentIndividuals | None = None
        self._slices: Slices | None = None
        self._always: dict[str, list[Assertion]] = {}  # what follows without facts, by property
        self._process = child
        self._buffer = bytearray()
        self._greeted = False
        if child is None:
            self._start()

    @property
    def pid(self) -> int | None:
        """Process id of the child, None while there is none."""
        return self._process.pid if self._process else None

    def load(self, ontology: str) -> None:
        """See Reasoner.load."""
        self._loaded, self._equivalent, self._slices = {}, None, None
        try:
            self._triples = list(parse_ntriples(ontology))
        except TripleError as error:
            raise ReasonerError(f"the ontology is no N-Triples: {error}") from error
        try:
            slices = Slices(self._triples)
        except SliceError as error:
            _log.debug("Pellet gets the whole ontology for each analysis: %s", error)
            self._load_whole()
            return
        whole = self._load_whole()
        always = sorted(self._infer(_WHOLE, whole, (), slices.properties), key=lambda value: value.property)
        if slices.implies(always):
            self._load(_COMMON, write_ntriples(slices.common))
            self._slices = slices
            self._always = {name: list(values) for name, values in groupby(always, key=lambda a: a.property)}
            self._forget(_WHOLE)
            self._equivalent = None

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """See Reasoner.infer."""
        part = self._slices.of(facts) if self._slices else None
        if part is None:
            return sorted(self._infer(_WHOLE, self._load_whole(), facts, properties))
        found = self._infer(_COMMON, part.individuals, [*facts, *part.statements], properties)
        return sorted(found.union(*(self._always.get(name, ()) for name in properties)))

    def close(self) -> None:
        """End the child."""
        process, self._process = self._process, None
        if process is None:
            return
        end(process)

    def _infer(
        self, name: str, individuals: EquivalentIndividuals, facts: Sequence[Assertion], properties: Sequence[str]
    ) -> set[Assertion]:
        added, expand = individuals.split(facts)
        values = self._ask_child(name, added, properties)
        if expand.is_ambiguous(values):
            added, expand = individuals.split(facts, deputies=2)
            values = self._ask_child(name, added, properties)
        return expand(values)

    def _load_whole(self) -> EquivalentIndividuals:
        """Have the child know the whole ontology, without a contradiction, and return its individuals."""
        if self._equivalent is None:
            self._equivalent = EquivalentIndividuals(self._triples)
            self._load(_WHOLE, write_ntriples(self._equivalent.reduced))
        return self._equivalent

    def _load(self, name: str, ontology: str) -> None:
        self._ask_twice({"op": "load", "name": name, "ontology": ontology})
        self._loaded[name] = ontology

    def _forget(self, name: str) -> None:
        self._ask_twice({"op": "forget", "name": name})
        del self._loaded[name]

    def _ask_child(self, name: str, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        request = {"op": "infer", "name": name, "facts": [list(fact) for fact in facts], "properties": list(properties)}
        return [Assertion(*row) for row in self._ask_twice(request)["values"]]

    def _jvm_options(self) -> list[str]:
        """Return further options; the JVM goes without an archive that is not of its version and of these jars."""
        return archive_options(self._jars)

    def _start(self) -> None:
        self._buffer.clear()
        self._greeted = False
        is_quiet = not _log.isEnabledFor(logging.DEBUG)
        self._process = spawn(self._jvm, self._jars, self._jvm_options(), self._heap_mb, is_quiet=is_quiet)

    def _ask_twice(self, request: dict[str, Any]) -> dict[str, Any]:
        """Ask the child. If it dies or hangs, start a new one and ask again."""
        try:
            return self._ask(request)
        except _ChildError as error:
            _log.warning("Pellet's process %s: starting it again", error)
        self.close()
        try:
            self._start()
        except OSError as error:
            raise ChildLostError(f"Pellet's process can't be started again: {error}") from error
        try:
            for name, ontology in self._loaded.items():
                if (request["op"], request["name"]) != ("load", name):
                    self._ask({"op": "load", "name": name, "ontology": ontology})
            return self._ask(request)
        except _ChildError as error:
            self.close()
            raise ChildLostError(f"Pellet's process {error}, twice in a row") from error

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        if self._process is None:
            raise _ChildError("is not running")
        if not self._greeted:
            greeting = self._receive(time.monotonic() + START_DEADLINE)
            if not greeting["ok"]:
                raise _ChildError(f"does not start ({greeting['message']})")
            self._greeted = True
        until = time.monotonic() + self._deadline
        data = json.dumps(request, separators=(",", ":")).encode("ascii")
        self._send(b"%d\n" % len(data) + data, until)
        answer = self._receive(until)
        self._check(answer)
        return answer

    @staticmethod
    def _check(answer: dict[str, Any]) -> None:
        if answer["ok"]:
            return
        if answer["inconsistent"]:
            raise InconsistentError(f"the ontology contradicts itself: {answer['message']}")
        raise ReasonerError(f"Pellet refuses: {answer['message']}")

    def _send(self, data: bytes, until: float) -> None:
        stream = self._process.stdin.fileno()  # type: ignore[union-attr]
        view = memoryview(data)
        while view:
            _, ready, _ = select.select([], [stream], [], max(0.0, until - time.monotonic()))
            if not ready:
                raise _ChildError("takes no request")
            try:
                view = view[os.write(stream, view) :]
            except OSError as error:
                raise _ChildError("has died") from error

    def _receive(self, until: float) -> dict[str, Any]:
        stream = self._process.stdout.fileno()  # type: ignore[union-attr]
        while True:
            header, newline, rest = self._buffer.partition(b"\n")
            if newline and len(rest) >= int(header):
                size = int(header)
                del self._buffer[: len(header) + 1 + size]
                return json.loads(rest[:size])
            ready, _, _ = select.select([stream], [], [], max(0.0, until - time.monotonic()))
            if not ready:
                raise _ChildError("does not answer in time")
            data = os.read(stream, 1 << 20)
            if not data:
                raise _ChildError("has died")
            self._buffer += data


class PelletWithFallback:
    """Pellet in its child process, or a slower reasoner while the child keeps failing.

    The child is tried again soon, since it may have failed for want of descriptors or memory for a moment. Each wait is
    twice the one before, and no shorter than the last try took: a child that hangs costs its deadlines.
    """

    def __init__(
        self,
        child: PelletReasoner,
        slow: Callable[[], Reasoner] = OwlreadyReasoner,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Use the child first.

        Args:
            child: the fast reasoner; it is closed with this one.
            slow: makes the slow reasoner.
            clock: wall clock, s.
        """
        self._child, self._slow, self._clock = child, slow, clock
        self._ontology = ""
        self._retry_at = -math.inf
        self._wait = 0.0  # s, the last one; 0 after a success

    @property
    def fallen_back(self) -> bool:
        """Whether the child has failed and the slower reasoner is in its place."""
        return self._retry_at > -math.inf

    def load(self, ontology: str) -> None:
        """See Reasoner.load."""
        self._ontology = ontology
        self._by_child(lambda: self._child.load(ontology), lambda _: None)

    def infer(self, facts: Sequence[Assertion], properties: Sequence[str]) -> list[Assertion]:
        """See Reasoner.infer."""
        return self._by_child(lambda: self._child.infer(facts, properties), lambda slow: slow.infer(facts, properties))

    def close(self) -> None:
        """See Reasoner.close."""
        self._child.close()

    def _by_child(self, fast: Callable[[], _Answer], otherwise: Callable[[Reasoner], _Answer]) -> _Answer:
        begin = self._clock()
        if begin >= self._retry_at:
            try:
                if self.fallen_back:  # the child has gone since it has loaded the ontology
                    self._child.load(self._ontology)
                    self._retry_at = -math.inf
                answer = fast()
            except ChildLostError as error:
                now = self._clock()
                self._wait = min(max(FIRST_RETRY, 2 * self._wait, now - begin), LONGEST_RETRY)
                self._retry_at = now + self._wait
                _log.warning(
                    "%s; going on with a new JVM for every analysis, more than a second each; next try in %.0f s",
                    error,
                    self._wait,
                )
            else:
                self._wait = 0.0
                return answer
        slow = self._slow()
        slow.load(self._ontology)
        return otherwise(slow)


def make_reasoner(child: subprocess.Popen[bytes] | None = None) -> Reasoner:
    """Return Pellet in a child process. If the child can't run, warn, and return owlready2's slow call.

    Args:
        child: a process that has been started already.

    Raises:
        NoJavaError: there is no Java runtime, without which neither runs.
    """
    try:
        return PelletWithFallback(PelletReasoner(child=child))
    except NoJavaError:
        raise
    except (ReasonerError, OSError) as error:
        _log.warning("%s; going on with a new JVM for every analysis, which takes more than a second each", error)
        return OwlreadyReasoner()


class _ChildError(Exception):
    """The child has failed; the text continues a sentence that begins with "Pellet's process"."""
