"""Behaviours for trees of py_trees, by which a task has the functions that it needs.

py_trees is not needed by the nodes: `pip install py_trees`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from mros1_reasoner.ros.asking import ACTION, Asking, Need, Standing


class PursueObjective(Behaviour):
    """Asks for a function while it is ticked.

    RUNNING until the function is fulfilled, FAILURE if it is pursued no longer. When it is fulfilled, the behaviour is

    - RUNNING by default: put it beside the task in a Parallel, with SuccessOnSelected([task]);
    - SUCCESS with `succeeds`: put it before the task in a Sequence without memory, which ticks it again each time.

    The function is given up when the tree interrupts the behaviour, or when it fails, or by `shutdown`.
    """

    def __init__(self, name: str, need: Need, *, succeeds: bool = False, action: str = ACTION) -> None:
        """Ask for nothing yet.

        Args:
            name: of the behaviour.
            need: what to ask for.
            succeeds: whether it succeeds when the function is fulfilled.
            action: name of the reasoner's action.
        """
        super().__init__(name=name)
        self._need, self._succeeds, self._action = need, succeeds, action
        self._asking: Asking | None = None

    def setup(self, **_: Any) -> None:
        """Connect to the reasoner; the node must have been initialised."""
        self._asking = self._asking or Asking(self._need, self._action)

    def initialise(self) -> None:
        """Ask from now on."""
        self.setup()
        if self._asking:
            self._asking.begin()

    def update(self) -> Status:
        """Return how the function stands."""
        standing, self.feedback_message = _look(self._asking)
        if standing is Standing.ENDED:
            return Status.FAILURE
        return Status.SUCCESS if standing is Standing.FULFILLED and self._succeeds else Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Give the function up, unless that is how it succeeds."""
        if self._asking and new_status != Status.SUCCESS:
            self._asking.end()

    def shutdown(self) -> None:
        """Give the function up."""
        if self._asking:
            self._asking.end()


class WhileObjective(Decorator):
    """Asks for a function while its child needs it, and gives it up when the child is done.

    The child begins when the function is fulfilled. RUNNING until then, FAILURE if the function is pursued no longer,
    and else as the child. While the reasoner adapts, the child is ticked on, or with `pauses` is not.
    """

    def __init__(self, name: str, child: Behaviour, need: Need, *, pauses: bool = False, action: str = ACTION) -> None:
        """Ask for nothing yet.

        Args:
            name: of the behaviour.
            child: the task.
            need: what to ask for.
            pauses: whether the task is not ticked while the function is not fulfilled.
            action: name of the reasoner's action.
        """
        super().__init__(name=name, child=child)
        self._need, self._pauses, self._action = need, pauses, action
        self._asking: Asking | None = None
        self._standing, self._has_begun = Standing.IDLE, False

    def setup(self, **_: Any) -> None:
        """Connect to the reasoner; the node must have been initialised."""
        self._asking = self._asking or Asking(self._need, self._action)

    def initialise(self) -> None:
        """Ask from now on."""
        self.setup()
        self._has_begun = False
        if self._asking:
            self._asking.begin()

    def tick(self) -> Iterator[Behaviour]:
        """Tick the child if it may work now.

        Yields:
            the child's behaviours, and itself.
        """
        if self.status != Status.RUNNING:
            self.initialise()
        self._standing, self.feedback_message = _look(self._asking)
        is_fulfilled = self._standing is Standing.FULFILLED
        self._has_begun |= is_fulfilled
        if is_fulfilled or (self._has_begun and not self._pauses and self._standing is not Standing.ENDED):
            yield from self.decorated.tick()
        found = self.update()
        if found != Status.RUNNING:
            self.stop(found)
        self.status = found
        yield self

    def update(self) -> Status:
        """Return how the child stands, which works only while the function is pursued."""
        if self._standing is Standing.ENDED:
            return Status.FAILURE
        return self.decorated.status if self._has_begun else Status.RUNNING

    def terminate(self, _: Status) -> None:
        """Give the function up."""
        if self._asking:
            self._asking.end()

    def shutdown(self) -> None:
        """Give the function up."""
        if self._asking:
            self._asking.end()


def _look(asking: Asking | None) -> tuple[Standing, str]:
    if asking is None:
        return Standing.IDLE, ""
    return asking.look(), asking.words
