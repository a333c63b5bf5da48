"""The action server of this node."""

from __future__ import annotations

import actionlib
from node_kit.ros.action_server import Sturdy


class ActionServer(Sturdy, actionlib.ActionServer):
    """actionlib's, which outlives a clock that is set back, and ends without a traceback."""
