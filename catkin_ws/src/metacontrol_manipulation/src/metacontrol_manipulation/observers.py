"""The observer of D1, a plug-in of the monitor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosgraph_monitor.observer import StaleInputError, TopicObserver
from std_msgs.msg import Float32

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus


class TagShareQualityObserver(TopicObserver):
    """Publishes `tag_share` at 5 Hz: the share of the last images in which a tag of the cell was found."""

    qa_name = "tag_share"
    max_age = 2.0

    def __init__(self, name: str = "TagShareQualityObserver") -> None:
        super().__init__(name, 5.0, [("tag_share", Float32)])

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the latest share."""
        share = msgs[0].data
        if not (math.isfinite(share) and 0.0 <= share <= 1.0):
            raise StaleInputError(f"tag_share {share} is no share from 0 to 1")
        return self.qa_status(share)
