"""What metacontrol.yaml may say of components and topics, and what the monitor takes, are the same."""

import pytest
import rospy
from node_kit.parameters import ParameterError
from ros_model.project.schema_check import load_schema, part_of, violations
from rosgraph_monitor.health.components import parse_components
from rosgraph_monitor.health.topics import parse_topics
from rosgraph_monitor.ros import parameters

SETTINGS = {
    "components": {
        "laser_resender": {"node": "front_laser", "topic": "front/scan", "min_rate": 5, "stuck_after": 50},
        "camera": {"topic": "camera/depth/points", "max_age": 1.0},
        "battery": {"topic": "battery_state", "below": 0.2, "above": 0.3},
    },
    "topics": {"odom": {"type": "nav_msgs/Odometry", "max_age": 0.5, "component": "base", "wall_time": True}},
}


def test_settings_pass_the_schema_and_the_monitor():
    schema = part_of(load_schema("metacontrol"), "components", "topics")
    assert [str(violation) for violation in violations(SETTINGS, schema)] == []
    components = parse_components(SETTINGS["components"])
    assert set(components.topics) == {"front/scan", "camera/depth/points"}
    assert components.batteries[0].component == "battery"
    assert parse_topics(SETTINGS["topics"])["odom"].max_age == 0.5


@pytest.mark.parametrize("rate", [1e-10, 0, 1e12])
def test_rate_at_which_no_thread_can_work_is_refused_with_its_range(monkeypatch, rate):
    monkeypatch.setattr(rospy, "get_param", lambda *_: {"rate": rate})
    monkeypatch.setattr(rospy, "get_name", lambda: "/rosgraph_monitor")
    with pytest.raises(ParameterError, match=r"/rosgraph_monitor/rate is .* at least 1e-06 and at most 100"):
        parameters.poll_rate()


@pytest.mark.parametrize(("given", "rate"), [({}, 2.0), ({"rate": 10}, 10.0)])
def test_usual_rate_and_another_one(monkeypatch, given, rate):
    monkeypatch.setattr(rospy, "get_param", lambda *_: given)
    assert parameters.poll_rate() == rate
