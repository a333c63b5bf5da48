"""What is asked of the manipulator: requests wait for their turn, and each one is answered once."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from rosgraph_manipulator.change.deployment import CancelledError, Outcome, Result
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue
from rosgraph_manipulator.configuration.configurations import ManipulatorOptions


@dataclass(frozen=True)
class Order:
    """What a request asks for.

    Attributes:
        function: the function to change.
        configuration: the one to deploy; empty: release the function.
        restart: nodes to restart even if they do not differ.
    """

    function: str
    configuration: str
    restart: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return what is asked for, in words."""
        return self.configuration or f"the release of {self.function}"


class Handle(Protocol):
    """The goal of a request, as actionlib's ServerGoalHandle; each one ends once, with a result and a text."""

    def set_accepted(self) -> Any:
        """Tell that the request will be carried out."""

    def set_rejected(self, result: Any, text: str) -> Any:
        """Refuse the request."""

    def set_succeeded(self, result: Any, text: str) -> Any:
        """Tell that the request is carried out."""

    def set_aborted(self, result: Any, text: str) -> Any:
        """Tell that the request could not be carried out."""

    def set_canceled(self, result: Any, text: str) -> Any:
        """Tell that the request was taken back, or given up for another one."""


@dataclass(frozen=True)
class _Request:
    order: Order
    handle: Handle
    result: Callable[[Outcome], Any]


class Requests:
    """The requests that wait, and the one that is carried out. Goals may come in other threads than the orders' one."""

    def __init__(
        self,
        options: ManipulatorOptions,
        policy: Policy,
        carry_out: Callable[[Order], Outcome],
        put: Callable[[Callable[[], object]], object],
        lock: AbstractContextManager[Any],
        none_follows: Callable[[str], object],
    ) -> None:
        """Begin without any.

        Args:
            options: the configurations that can be asked for.
            policy: what happens to a request while another one of its function is carried out.
            carry_out: carries out an order in the thread of orders.
            put: leaves work for that thread.
            lock: keeps threads apart.
            none_follows: is called in the thread of orders with a function of which a waiting request was taken back:
                a change may have been given up for it.
        """
        self._options, self._carry_out, self._put, self._lock = options, carry_out, put, lock
        self._none_follows = none_follows
        self._queue = RequestQueue(policy)
        self._requests: dict[str, _Request] = {}
        self._interruption: CancelledError | None = None

    def check(self) -> None:
        """Raise where the order that is carried out must be given up.

        Raises:
            CancelledError: it was taken back or replaced.
        """
        interruption = self._interruption
        if interruption is not None:
            raise interruption

    def order_for(self, name: str) -> tuple[Order | None, str]:
        """Return the order that deploys a configuration, or None and why there is none."""
        configuration = self._options.configurations.get(name)
        return (Order(configuration.function, name), "") if configuration else (None, self._unknown(name))

    def order_of_function(
        self, function: str, configuration: str, restart: tuple[str, ...] = ()
    ) -> tuple[Order | None, str]:
        """Return the order that changes or releases a function, or None and why there is none.

        Args:
            function: its name.
            configuration: the one to deploy; empty: release the function.
            restart: full names of nodes to restart even if they do not differ.
        """
        found = self._options.configurations.get(configuration)
        if function not in self._options.all_functions:
            known = ", ".join(sorted(self._options.all_functions))
            return None, f"unknown function '{function}'; known are: {known}"
        if configuration and found is None:
            return None, self._unknown(configuration)
        if found is not None and found.function != function:
            return None, f"configuration {configuration} is of function {found.function}, not {function}"
        return Order(function, configuration, restart), ""

    def take(self, name: str, order: Order, handle: Handle, result: Callable[[Outcome], Any]) -> None:
        """Take in a request.

        Args:
            name: its own among all requests: goals of two actions may have the same id.
            order: what it asks for.
            handle: its goal.
            result: makes the goal's result.
        """
        with self._lock:
            arrival = self._queue.arrive(name, order.function)
            dropped = [self._requests.pop(old) for old in arrival.dropped]
            if arrival.accepted:
                self._requests[name] = _Request(order, handle, result)
            if arrival.interrupts:
                self._interruption = CancelledError(f"given up for {order}", superseded=True)
        for old in dropped:
            _cancel(old, f"given up for {order}")
        if not arrival.accepted:
            reason = "another change is under way"
            handle.set_rejected(result(Outcome(Result.FAILED, None, reason)), reason)
            return
        handle.set_accepted()
        self._put(self._next)

    def refuse(self, handle: Handle, problem: str, result: Callable[[Outcome], Any]) -> None:
        """Answer a request that asks for nothing that there is."""
        handle.set_accepted()
        handle.set_aborted(result(Outcome(Result.UNKNOWN, None, problem)), problem)

    def take_back(self, name: str) -> None:
        """Take in that whoever has made a request wants it no longer."""
        waited = None
        with self._lock:
            if self._queue.take_back(name):
                waited = self._requests.pop(name)
            elif self._queue.running == name and self._interruption is None:
                self._interruption = CancelledError("the request was taken back")
        if waited:
            function = waited.order.function
            _cancel(waited, "taken back before its turn came")
            self._put(lambda: self._none_follows(function))

    def _unknown(self, name: str) -> str:
        return f"unknown configuration '{name}'; known are: {', '.join(sorted(self._options.configurations))}"

    def _next(self) -> None:
        with self._lock:
            name = self._queue.next()
            request = self._requests.pop(name) if name else None
            self._interruption = None
        if request is None:
            return
        try:
            outcome = self._carry_out(request.order)
        finally:
            with self._lock:
                self._queue.finish()
                self._interruption = None
        result = request.result(outcome)
        if outcome.result is Result.OK:
            request.handle.set_succeeded(result, outcome.message)
        elif outcome.cancelled:
            request.handle.set_canceled(result, outcome.message)
        else:
            request.handle.set_aborted(result, outcome.message)


def _cancel(request: _Request, reason: str) -> None:
    request.handle.set_canceled(request.result(Outcome(Result.FAILED, None, reason)), reason)
