"""Observers in the published form, for the test of the monitor."""

import time

from diagnostic_msgs.msg import DiagnosticStatus
from rosgraph_monitor.observer import TopicObserver
from std_msgs.msg import Float32


class FailingObserver(TopicObserver):
    """Raises on every message."""

    def __init__(self, name):
        super().__init__(name, 10, [("failing/input", Float32)])

    def calculate_attr(self, msgs):
        status = DiagnosticStatus()
        status.name = self._id
        raise ValueError(f"no sense in {msgs[0].data}")


class BrokenObserver(TopicObserver):
    """Can't even be made."""

    def __init__(self, name):
        raise RuntimeError(name)


class HangingObserver(TopicObserver):
    """Never comes back from a message."""

    def __init__(self, name):
        super().__init__(name, 10, [("failing/input", Float32)])

    def calculate_attr(self, msgs):
        while True:
            time.sleep(0.1)


class QuittingObserver(TopicObserver):
    """Wants to end the whole process."""

    def __init__(self, name):
        super().__init__(name, 10, [("failing/input", Float32)])

    def calculate_attr(self, msgs):
        raise SystemExit(3)


class HealthyObserver(TopicObserver):
    """Listens to the same topic as those that fail."""

    def __init__(self, name):
        super().__init__(name, 10, [("failing/input", Float32)])

    def calculate_attr(self, msgs):
        return self.qa_status(msgs[0].data)
