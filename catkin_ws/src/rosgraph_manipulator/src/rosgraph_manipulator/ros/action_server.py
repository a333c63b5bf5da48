"""The action server of this node."""

from __future__ import annotations

import actionlib
from node_kit.ros.action_server import EndsQuietly


class ActionServer(EndsQuietly, actionlib.ActionServer):
    """actionlib's, without a traceback when the node ends."""
