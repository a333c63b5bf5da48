"""Motor temperature as a quality level: 0 is cool, 1 is where the motor switches itself off."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rosgraph_monitor.observer import TopicObserver
from sensor_msgs.msg import Temperature


class MotorTemperatureObserver(TopicObserver):
    """Publishes `motor_temperature` once per second. While the topic is silent, the level is stale."""

    qa_name = "motor_temperature"
    defaults = {"cool": 40.0, "hot": 90.0}  # degrees Celsius; a user sets them as ~MotorTemperatureObserver/cool

    def __init__(self, name: str = "MotorTemperatureObserver") -> None:
        super().__init__(name, 1.0, [("motor/temperature", Temperature)])

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the level of the latest temperature."""
        return self.qa_status(level(msgs[0].temperature, self.settings["cool"], self.settings["hot"]))


def level(temperature: float, cool: float, hot: float) -> float:
    """Return the level of a temperature: 0 at `cool` and below, 1 at `hot` and above, in degrees Celsius."""
    return min(max((temperature - cool) / (hot - cool), 0.0), 1.0)
