"""Who takes inputs: readers of files, listeners to topics, and servers of requests."""

from __future__ import annotations

from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from bad_input.listeners import LISTENERS, Listener, mutated_messages, packed, take
from bad_input.mutation import mutated
from bad_input.readers import READERS, Reader
from bad_input.servers import SERVERS

if TYPE_CHECKING:
    from random import Random

CORPUS = Path(__file__).with_name("corpus")
"""A folder for each subject, with inputs that once broke it."""
_LONGEST = 4000


class Subject(Protocol):
    """Somebody who takes an input."""

    name: str
    share: float

    def mutated(self, rng: Random) -> bytes:
        """Return a bad input."""
        ...

    def run(self, data: bytes, folder: Path) -> str | None:
        """Take an input in an empty folder; return the refusal, or None where it is accepted.

        Raises:
            Exception: the subject is broken.
        """
        ...

    def fault_of(self, refusal: str) -> str:
        """Return what is wrong with a refusal, or an empty text."""
        ...


class ReaderSubject:
    """A reader of files."""

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.name, self.share = reader.name, reader.share

    @cached_property
    def seeds(self) -> list[bytes]:
        """Good files, and those that once broke the reader."""
        return [*self.reader.seeds(), *kept(self.name)]

    def mutated(self, rng: Random) -> bytes:
        """Return a bad file."""
        return mutated(rng, self.seeds, self.reader.kind)

    def run(self, data: bytes, folder: Path) -> str | None:
        """Read a file."""
        path = folder / self.reader.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        try:
            self.reader.read(path)
        except self.reader.errors as error:
            return str(error)
        return None

    def fault_of(self, refusal: str) -> str:
        """Return what is wrong with a refusal: it is one line that names the file, and can be printed."""
        if self.reader.names_file and not any(name in refusal for name in (Path(self.reader.file).name, "/input")):
            return "a refusal does not name the file"
        return _fault(refusal)


class ListenerSubject:
    """A listener to topics."""

    def __init__(self, listener: Listener) -> None:
        self.listener = listener
        self.name, self.share = listener.name, listener.share

    @cached_property
    def seeds(self) -> list[bytes]:
        """Good messages, and those that once broke the listener."""
        return [packed(self.listener, self.listener.seeds()), *kept(self.name)]

    def mutated(self, rng: Random) -> bytes:
        """Return bad messages."""
        return mutated_messages(rng, self.listener, self.seeds)

    def run(self, data: bytes, folder: Path) -> str | None:
        """Take messages."""
        return take(self.listener, data)

    def fault_of(self, refusal: str) -> str:
        """Return an empty text: it is logged as it is."""
        return ""


@cache
def subjects() -> tuple[Subject, ...]:
    """Return all subjects."""
    return (*map(ReaderSubject, READERS), *map(ListenerSubject, (*LISTENERS, *SERVERS)))


def subject_of(name: str) -> Subject:
    """Return the subject of a name."""
    return next(subject for subject in subjects() if subject.name == name)


def slug(name: str) -> str:
    """Return the folder's name of a subject in the corpus."""
    return "".join(mark if mark.isalnum() else "-" for mark in name.lower())


def kept(name: str) -> list[bytes]:
    """Return inputs that once broke a subject."""
    folder = CORPUS / slug(name)
    return [path.read_bytes() for path in sorted(folder.iterdir())] if folder.is_dir() else []


def _fault(refusal: str) -> str:
    if len(refusal.splitlines()) != 1:
        return "a refusal is not one line"
    if not refusal.isprintable():
        return "a refusal has marks that can't be printed"
    return "a refusal is too long" if len(refusal) > _LONGEST else ""
