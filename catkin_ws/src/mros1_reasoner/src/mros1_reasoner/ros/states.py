"""A state for machines of SMACH, by which a task has the function that it needs.

It is a smach.State where SMACH is installed, and has the same interface where it is not.
"""

from __future__ import annotations

import threading
from typing import Any

import rospy

from mros1_reasoner.ros.asking import ACTION, Asking, Need, Standing

try:
    from smach import State
except ImportError:

    class State:  # type: ignore[no-redef]
        """What containers use of a smach.State."""

        def __init__(self, outcomes: Any = (), input_keys: Any = (), output_keys: Any = (), io_keys: Any = ()) -> None:
            self._outcomes = set(outcomes)
            self._input_keys = {*input_keys, *io_keys}
            self._output_keys = {*output_keys, *io_keys}
            self._is_preempted = False

        def get_registered_outcomes(self) -> tuple[str, ...]:
            """Return the outcomes."""
            return tuple(self._outcomes)

        def get_registered_input_keys(self) -> tuple[str, ...]:
            """Return what it reads of the user's data."""
            return tuple(self._input_keys)

        def get_registered_output_keys(self) -> tuple[str, ...]:
            """Return what it writes of the user's data."""
            return tuple(self._output_keys)

        def request_preempt(self) -> None:
            """Ask it to end."""
            self._is_preempted = True

        def preempt_requested(self) -> bool:
            """Return whether it is to end."""
            return self._is_preempted

        def service_preempt(self) -> None:
            """Note that it ends."""
            self._is_preempted = False

        def recall_preempt(self) -> None:
            """Take the request to end back."""
            self._is_preempted = False


UNFULFILLED = "unfulfilled"
PREEMPTED = "preempted"
_PERIOD = 0.05  # s, wall, between two looks
_GOODBYE = 2.0  # s, wall, for the reasoner to take note of the end


class WhileObjective(State):
    """Asks for a function while its task needs it: the task begins when the function is fulfilled.

    The outcomes are those of the task, `unfulfilled` if the function is pursued no longer, and `preempted`. If the
    function is lost while the task works, the task is asked to end by `request_preempt`.
    """

    def __init__(self, task: State, need: Need, *, action: str = ACTION) -> None:
        """Ask for nothing yet.

        Args:
            task: a state, or a container of states.
            need: what to ask for.
            action: name of the reasoner's action.
        """
        super().__init__(
            outcomes=[*task.get_registered_outcomes(), UNFULFILLED, PREEMPTED],
            input_keys=list(task.get_registered_input_keys()),
            output_keys=list(task.get_registered_output_keys()),
        )
        self._task, self._need, self._action = task, need, action
        self._asking: Asking | None = None
        self._is_done = threading.Event()
        self._is_lost = self._has_begun = False

    def execute(self, userdata: Any) -> str:
        """Do the task, and give the function up; return the outcome."""
        self._asking = asking = self._asking or Asking(self._need, self._action)
        self._is_lost = self._has_begun = False
        self._is_done.clear()
        asking.begin()
        try:
            outcome = self._wait(asking) or self._work(asking, userdata)
        finally:
            asking.end()
            asking.wait(_GOODBYE)
        if self._is_lost:
            rospy.logwarn(f"{self._need.function} is pursued no longer: {asking.words}")
            outcome = UNFULFILLED
        if self.preempt_requested():
            self.service_preempt()
        return outcome

    def request_preempt(self) -> None:
        """End soon; a task at work is asked to end, too."""
        super().request_preempt()
        if self._has_begun:
            self._task.request_preempt()

    def _wait(self, asking: Asking) -> str:
        """Wait until the function is fulfilled; return the outcome if that will not be."""
        while True:
            if self.preempt_requested() or rospy.is_shutdown():
                return PREEMPTED
            standing = asking.look()
            if standing is Standing.FULFILLED:
                return ""
            if standing is Standing.ENDED:
                self._is_lost = True
                return UNFULFILLED
            self._is_done.wait(_PERIOD)

    def _work(self, asking: Asking, userdata: Any) -> str:
        """Do the task; return its outcome."""
        watch = threading.Thread(target=self._watch, args=(asking,), daemon=True)
        watch.start()
        self._has_begun = True
        if self.preempt_requested():  # just now
            self._task.request_preempt()
        try:
            return str(self._task.execute(userdata))
        finally:
            self._has_begun = False
            self._is_done.set()
            watch.join()

    def _watch(self, asking: Asking) -> None:
        """Look after the function until the task is done; ask again where the reasoner was started anew."""
        while not self._is_done.wait(_PERIOD):
            if asking.look() is Standing.ENDED:
                self._is_lost = True
                self._task.request_preempt()
                return
