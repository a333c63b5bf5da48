"""Observers in the published form, for the test of the monitor."""

import time

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rosgraph_monitor.observer import Observer, ServiceObserver, TopicObserver
from std_msgs.msg import Float32
from std_srvs.srv import Trigger


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


class ServedQualityObserver(ServiceObserver):
    """Reads its level from the answer of a service; written as for the published monitor."""

    def __init__(self, name):
        super(ServedQualityObserver, self).__init__(name, "/served_level", Trigger)  # noqa: UP008 - as published

    def diagnostics_from_response(self, resp):
        status = DiagnosticStatus(level=DiagnosticStatus.OK, message="QA status")
        status.values.append(KeyValue("served", resp.message))
        return [status]


class TimelessObserver(Observer):
    """Does without the time; written as for the published monitor."""

    def __init__(self, name):
        super(TimelessObserver, self).__init__(name)  # noqa: UP008 - as published

    def generate_diagnostics(self):
        return [DiagnosticStatus(name="timeless", message="QA status", values=[KeyValue("timeless", "0.25")])]
