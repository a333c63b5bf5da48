"""Passes the log of the pure core on to rosout."""

from __future__ import annotations

import logging

import rospy

PREFIX = "[RosReasoner] -- %s"  # as the published reasoner's


def log_core() -> None:
    """Pass the core's log on to rosout, as the node's own."""
    logger = logging.getLogger("mros1_reasoner")
    logger.setLevel(logging.INFO)
    logger.propagate = False
    logger.addHandler(_RosLog())


class _RosLog(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        """Log a record as the node's own."""
        log = rospy.logwarn if record.levelno >= logging.WARNING else rospy.loginfo
        log(PREFIX, record.getMessage())
