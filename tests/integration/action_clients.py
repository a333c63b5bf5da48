"""A client of actions for goals that may end at once."""

import threading

import actionlib


class SureActionClient(actionlib.SimpleActionClient):
    """Hears also of a goal that ends before `send_goal` has returned, such as one that is refused.

    actionlib's own client knows the goal only then, drops what it hears before, and waits in vain.
    """

    def __init__(self, ns, ActionSpec):  # noqa: N803 actionlib's name
        self._lock = threading.Lock()
        self._early = []  # handles of goals of which something was heard, and which were not the present one
        super().__init__(ns, ActionSpec)

    def send_goal(self, *arguments, **callbacks):
        super().send_goal(*arguments, **callbacks)
        with self._lock:
            if self.gh in self._early:
                super()._handle_transition(self.gh)
            self._early.clear()

    def _handle_transition(self, gh):
        with self._lock:
            if gh == self.gh:
                super()._handle_transition(gh)
            else:
                self._early.append(gh)
