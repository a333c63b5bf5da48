"""The simulated clock: events in the order of their times, and tasks that wait. One seed gives one order."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable

from greenlet import GreenletExit, getcurrent, greenlet

POLL = 0.01  # s, between two looks of a task that waits for a condition


class Kernel:
    """The clock, the events to come and the tasks.

    Attributes:
        now: the time, s; it never goes back.
        steps: how many events have happened.
        random: all chance comes from it.
        after_step: is called after each event.
    """

    def __init__(self, seed: int) -> None:
        self.now = 0.0
        self.steps = 0
        self.random = random.Random(seed)
        self.after_step: Callable[[], object] = lambda: None
        self._events: list[tuple[float, int, Callable[[], object]]] = []
        self._count = 0

    def at(self, time: float, work: Callable[[], object]) -> None:
        """Have something done at a time, s, or now where that is over."""
        self._count += 1
        heapq.heappush(self._events, (max(time, self.now), self._count, work))

    def after(self, delay: float, work: Callable[[], object]) -> None:
        """Have something done after a delay, s."""
        self.at(self.now + delay, work)

    def run(self, until: float) -> None:
        """Let time pass until then, s."""
        while self._events and self._events[0][0] <= until:
            self.now, _, work = heapq.heappop(self._events)
            work()
            self.steps += 1
            self.after_step()
        self.now = max(self.now, until)

    def uniform(self, low: float, high: float) -> float:
        """Return a number between two others, by chance."""
        return self.random.uniform(low, high)


class Process:
    """A process of the simulated host: tasks that end together when it is killed.

    Attributes:
        name: of its node.
        alive: whether it runs.
        frozen: whether it is stopped (SIGSTOP): its tasks go on when it continues.
        started: when it has begun, s.
        awake_since: when it has begun or gone on last, s.
    """

    def __init__(self, kernel: Kernel, name: str, failed: Callable[[str, BaseException], object]) -> None:
        """Begin without tasks.

        Args:
            kernel: the clock.
            name: of its node.
            failed: is called with the name and the exception that has ended one of its tasks.
        """
        self.kernel, self.name, self._failed = kernel, name, failed
        self.alive, self.frozen = True, False
        self.started = self.awake_since = kernel.now
        self._tasks: list[greenlet] = []
        self._late: list[Callable[[], object]] = []

    def start(self, work: Callable[[], object]) -> None:
        """Begin a task."""

        def run() -> None:
            try:
                work()
            except GreenletExit:
                pass
            except KeyboardInterrupt:  # whoever watches ends the simulation
                raise
            except BaseException as error:  # that a core let out
                self._failed(self.name, error)

        task = greenlet(run)
        self._tasks.append(task)
        self.kernel.after(0.0, lambda: self.go_on(task))

    def call(self, work: Callable[[], object]) -> None:
        """Have a callback done now, as another thread would."""
        if self.frozen:
            self._late.append(lambda: self.start(work))
        elif self.alive:
            self.start(work)

    def check(self) -> None:
        """Raise where the process is dead: it does nothing any more, whatever its code would clean up."""
        if not self.alive:
            raise GreenletExit

    def pause(self, duration: float) -> None:
        """Let so many s pass; from a task only."""
        self.check()
        task = getcurrent()
        self.kernel.after(duration, lambda: self.go_on(task))
        task.parent.switch()
        self.check()

    def wait_for(self, condition: Callable[[], bool], timeout: float, period: float = POLL) -> bool:
        """Wait until a condition is true, so many s at most; return whether it is."""
        end = self.kernel.now + timeout
        while not condition():
            if self.kernel.now >= end:
                return False
            self.pause(min(period, max(end - self.kernel.now, 1e-6)))
        return True

    def freeze(self) -> None:
        """Stop the process."""
        self.frozen = True

    def thaw(self) -> None:
        """Let the process go on."""
        if self.frozen:
            self.awake_since = self.kernel.now
        self.frozen = False
        late, self._late = self._late, []
        for work in late:
            self.kernel.after(0.0, work)

    def kill(self) -> None:
        """End the process at once."""
        self.alive = False
        tasks, self._tasks = self._tasks, []
        for task in tasks:
            if not task.dead and task is not getcurrent() and task:
                task.throw()

    def go_on(self, task: greenlet) -> None:
        """Let a task go on."""
        if self.frozen and self.alive:
            self._late.append(lambda: self.go_on(task))
        elif self.alive and not task.dead:
            task.parent = getcurrent()
            task.switch()
            if task.dead and task in self._tasks:
                self._tasks.remove(task)


class Inbox:
    """Work that others leave for one task of a process."""

    def __init__(self, process: Process) -> None:
        self._process = process
        self._work: list[Callable[[], object]] = []
        self._wait = 0  # number of the present wait; 0: nobody waits
        self._waits = 0
        self._task: greenlet | None = None

    def __len__(self) -> int:
        """Return how many pieces of work wait."""
        return len(self._work)

    def put(self, work: Callable[[], object] = lambda: None) -> bool:
        """Leave work."""
        self._work.append(work)
        self._wake(self._wait)
        return True

    def wait(self, longest: float | None = None) -> None:
        """Wait for work, so many s at most; None: as long as it takes."""
        self._process.check()
        if self._work:
            return
        self._waits += 1
        self._wait, self._task = self._waits, getcurrent()
        if longest is not None:
            number = self._wait
            self._process.kernel.after(longest, lambda: self._wake(number))
        self._task.parent.switch()
        self._process.check()

    def do_next(self) -> None:
        """Do the first piece of work."""
        self._work.pop(0)()

    def drain(self) -> None:
        """Do the work that waits now."""
        for _ in range(len(self._work)):
            self._work.pop(0)()

    def _wake(self, number: int) -> None:
        task = self._task
        if task is not None and number and number == self._wait:
            self._wait, self._task = 0, None
            self._process.kernel.after(0.0, lambda: self._process.go_on(task))
