"""What an operator has asked for and still holds: a reasoner that takes the place of one that died begins with it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace

from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop import entries
from mros1_reasoner.loop.entries import Command
from mros1_reasoner.loop.entry_text import kind_of, read_entry, values_of
from mros1_reasoner.loop.readable_state import MapeError


class Asked:
    """The commands that still hold, in the order in which they came; a later one replaces what it takes back."""

    def __init__(self, commands: Iterable[Command] = (), at_start: Collection[str] | None = None) -> None:
        """Begin with the commands that hold already.

        Args:
            commands: these.
            at_start: names of the objectives that a reasoner asks for from the start: to remove another one needs not
                be kept; None: any may be one of these.
        """
        self._at_start = at_start
        self._commands: list[Command] = []
        self._early: list[Command] = []  # of these, what is for objectives that are still to come
        self._again: list[Command] = []  # of these, limits that a task replaces which asks anew for their objective
        for command in commands:
            self.heed(command)
        self._again += [command for command in self._commands if isinstance(command, entries.SetNfr)]

    @property
    def commands(self) -> tuple[Command, ...]:
        """The commands that hold."""
        return tuple(self._commands)

    def heed(self, command: Command, objectives: Collection[str] = ()) -> None:
        """Take in a command that was carried out.

        Args:
            command: what was asked for.
            objectives: names of those that there are: one for all holds for each of them, also where they come into
                being later, as they do in a reasoner that begins.
        """
        if isinstance(command, entries.Approve | entries.Reject):
            return
        heeded = [command]
        if isinstance(command, entries.Lock | entries.SetNfr) and not command.objective and objectives:
            heeded = [replace(command, objective=name) for name in objectives]
        for one in heeded:
            self._commands = [before for before in self._commands if not _replaces(one, before)]
            self._early = [before for before in self._early if not _replaces(one, before)]
            self._again = [before for before in self._again if not _replaces(one, before)]
        if not isinstance(command, entries.Resume | entries.Unlock) and not self._is_void(command):
            self._commands += heeded

    def _is_void(self, command: Command) -> bool:
        """Return whether a command does nothing in a reasoner that begins."""
        if self._at_start is None or not isinstance(command, entries.RemoveObjective):
            return False
        return command.name not in self._at_start

    def settle(self, locked: Collection[str], objectives: Collection[str]) -> bool:
        """Forget the locks and limits of objectives that went; return whether there were any.

        Args:
            locked: the objectives that are locked.
            objectives: names of those that there are, or that a design may require.
        """

        def holds(command: Command) -> bool:
            if isinstance(command, entries.Lock):
                return command.objective in locked or command in self._early
            if isinstance(command, entries.SetNfr):
                return command.objective in ("", *objectives) or command in self._early
            return True

        before = len(self._commands)
        self._commands = [command for command in self._commands if holds(command)]
        return len(self._commands) < before

    def put_off(self, command: Command, objectives: Collection[str]) -> bool:
        """Have a lock or limit wait for its objective, which a task asks for anew; return whether that makes sense.

        Args:
            command: what could not be carried out.
            objectives: names of those that there are.
        """
        waits = isinstance(command, entries.Lock | entries.SetNfr) and command.objective not in ("", *objectives)
        self._early += [command] if waits else []
        self._again = [c for c in self._again if not (waits and c == command)]
        return waits

    def due(self, objectives: Collection[str]) -> list[Command]:
        """Return what has waited for objectives that there are now; it waits no longer."""
        found = [c for c in self._early if getattr(c, "objective", "") in objectives]
        self._early = [c for c in self._early if c not in found]
        return found

    def asked_anew(self, objective: str) -> list[Command]:
        """Return, once, the limits of an objective for which a task has asked anew, with limits of its own."""
        found = [c for c in self._again if getattr(c, "objective", "") == objective]
        self._again = [c for c in self._again if c not in found]
        return found

    def wait_no_longer(self) -> bool:
        """Forget what waits for objectives; return whether anything did."""
        early, self._early, self._again = self._early, [], []
        self._commands = [command for command in self._commands if command not in early]
        return bool(early)

    def as_parameter(self) -> list[list[str]]:
        """Return the commands as a value of a parameter: of each, its kind and values."""
        return [[kind_of(command), *values_of(command)] for command in self._commands]

    @classmethod
    def from_parameter(cls, value: object, at_start: Collection[str] | None = None) -> Asked:
        """Return the commands that a parameter has; those that can't be read are left out.

        Args:
            value: of the parameter.
            at_start: names of the objectives that a reasoner asks for from the start; None: unknown.
        """
        found: list[Command] = []
        for item in value if isinstance(value, Sequence) and not isinstance(value, str) else ():
            if not isinstance(item, list) or not item:
                continue
            try:
                content = read_entry(0.0, str(item[0]), [str(part) for part in item[1:]]).content
            except ValueError:
                continue
            if isinstance(content, Command):
                found.append(content)
        return cls(found, at_start)


def carry_out(commands: Iterable[Command], do: Callable[[Command], object]) -> list[tuple[Command, Exception]]:
    """Carry out commands. Those that fail are tried again after the others, as long as that helps.

    The two limits of a band may fit the former ones, and each other, in one order only.

    Returns:
        The commands that have failed, and why.
    """
    left = list(commands)
    while True:
        failed: list[tuple[Command, Exception]] = []
        for command in left:
            try:
                do(command)
            except (MapeError, KnowledgeBaseError, ReasonerError) as error:
                failed.append((command, error))
        if len(failed) in (0, len(left)):
            return failed
        left = [command for command, _ in failed]


def _replaces(command: Command, before: Command) -> bool:
    """Return whether a command makes one before it void."""
    match command, before:
        case entries.Pause() | entries.Resume(), entries.Pause():
            return True
        case entries.Lock(name) | entries.Unlock(name), entries.Lock(other):
            return name in ("", other)
        case entries.SetNfr(name, quality, _), entries.SetNfr(other, same, _):
            return quality == same and name in ("", other)
        case entries.RemoveObjective(name), _:
            return name in (getattr(before, "objective", ""), getattr(before, "name", ""))
    return False
