"""How long a recorded report is kept back."""

import pytest
import rospy
from metacontrol_experiments.ros.recorded_reports import _left


@pytest.mark.parametrize(("now", "left"), [(10.0, 1.5), (10.5, 1.0), (12.0, -0.5), (3.0, 0.0)])
def test_report_is_not_kept_back_longer_where_the_bag_is_played_again(now, left):
    assert _left(rospy.Time(10), rospy.Time.from_sec(now), rospy.Duration.from_sec(1.5)).to_sec() == pytest.approx(left)
