"""Localization: the uncertainty of the robot's position."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from robot_formulas.level import normalised
from robot_formulas.localization import position_uncertainty

from rosgraph_monitor.observer import StaleInputError, TopicObserver, Topics

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus


class LocalizationQualityObserver(TopicObserver):
    """Publishes `localization` at 2 Hz: 0 for a certain position, 1 for a standard deviation of `worst` or more."""

    qa_name = "localization"
    max_age = 5.0
    defaults = {"pose_topic": "amcl_pose", "worst": 0.5}  # m: a robot's width, beyond which a corridor is a guess

    def __init__(self, name: str = "LocalizationQualityObserver") -> None:
        super().__init__(name, 2.0, [])

    @property
    def topics(self) -> Topics:
        """The pose with its covariance."""
        return [(self.settings["pose_topic"], PoseWithCovarianceStamped)]

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the level of the latest pose."""
        covariance = msgs[0].pose.covariance
        try:
            deviation = position_uncertainty(covariance[0], covariance[1], covariance[7])
            return self.qa_status(normalised(deviation, 0.0, self.settings["worst"]))
        except ValueError as error:
            raise StaleInputError(str(error)) from error
