"""Has rospy read once what it asks the master for with the first line of a log.

rospy adds the node's topics to each line on /rosout, unless the parameter /rosout_disable_topics_generation is set. For
that it subscribes to the parameter with the first line, which registers the node at the master, as each subscription
does. Where the line comes late, from a node whose name another one has meanwhile, the master ends that other one.

A later change of the parameter has no effect here.
"""

from __future__ import annotations

import http.client
import xmlrpc.client
from types import SimpleNamespace
from typing import Any

import rospy
from rospy.impl import rosout

PARAMETER = "/rosout_disable_topics_generation"

_ERRORS = (OSError, http.client.HTTPException, xmlrpc.client.Error, rospy.ROSException)


def read_rosout_parameter() -> None:
    """Read the parameter now, and have the log use its value; False where the master does not tell it."""
    try:
        value = rospy.get_param(PARAMETER, False)
    except _ERRORS:  # it is no reason to refuse a start
        value = False

    def get_param_cached(name: str, *default: Any) -> Any:
        return value if name == PARAMETER else rospy.get_param_cached(name, *default)

    rosout.rospy = SimpleNamespace(**{**vars(rospy), "get_param_cached": get_param_cached})
