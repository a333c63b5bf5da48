"""Light: the illuminance around the robot, a property of its surroundings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from sensor_msgs.msg import Illuminance

from rosgraph_monitor.observer import StaleInputError, TopicObserver, Topics

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus


class LightObserver(TopicObserver):
    """Publishes `light` at 5 Hz: the illuminance as a share of that of a well-lit place, 0 in the dark."""

    qa_name = "light"
    max_age = 1.0
    defaults = {"topic": "illuminance", "well_lit": 300.0}  # lx: EN 12464-1 asks for it where goods are handled

    def __init__(self, name: str = "LightObserver") -> None:
        super().__init__(name, 5.0, [])

    @property
    def topics(self) -> Topics:
        """The light sensor's."""
        return [(self.settings["topic"], Illuminance)]

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the share of the latest measurement."""
        measured, well_lit = msgs[0].illuminance, self.settings["well_lit"]
        if not (math.isfinite(measured) and measured >= 0.0):
            raise StaleInputError(f"illuminance {measured} lx is none: the sensor is broken")
        if well_lit <= 0.0:
            raise StaleInputError(f"well_lit is {well_lit}: give the lx of a well-lit place")
        return self.qa_status(measured / well_lit)
