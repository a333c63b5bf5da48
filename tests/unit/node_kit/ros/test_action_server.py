"""An action server whose node ends while it publishes the status."""

import pytest
import rospy
from node_kit.ros.action_server import EndsQuietly


class Closed:
    """What actionlib's server does when the topic is closed."""

    def publish_status(self):
        raise rospy.ROSException("publish() to a closed topic")


class Server(EndsQuietly, Closed):
    pass


def test_closed_topic_is_no_traceback_at_the_end(monkeypatch):
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: True)  # is_shutdown() is not true yet
    Server().publish_status()


def test_closed_topic_is_told_while_the_node_runs(monkeypatch):
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: False)
    with pytest.raises(rospy.ROSException, match="closed topic"):
        Server().publish_status()
