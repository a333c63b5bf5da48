"""The log of the node reasoner: only a few lines, even if many things go wrong."""

from __future__ import annotations

import time

import rospy
from metacontrol_bags.decision import EXECUTED, FAILED, Decision

from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.diagnostics import Remark
from mros1_reasoner.loop.entries import LevelFact, StaleFact
from mros1_reasoner.planning.log_line import line
from mros1_reasoner.ros.core_log import PREFIX
from mros1_reasoner.ros.log_throttle import LogThrottle
from mros1_reasoner.ros.unobserved import Unobserved

_LONGEST = 1000  # remarks that are told once
_LEVEL_PERIOD = 30.0
"""Wall s in which the level of a quality attribute is told once."""


class Log:
    """Tells on rosout what the node does."""

    def __init__(self) -> None:
        """Nothing is told yet."""
        self._warnings, self._levels = LogThrottle(), LogThrottle(_LEVEL_PERIOD, burst=1)
        self._unobserved = Unobserved()
        self._told: set[str] = set()

    def tell(self, text: str) -> None:
        """Tell something."""
        rospy.loginfo(PREFIX, text)

    def warn(self, kind: str, text: str) -> None:
        """Warn of a problem, unless many problems of the same kind were just logged."""
        said = self._warnings.admit(time.monotonic(), kind, text)
        if said:
            is_published = text.startswith("Unsupported QA TYPE received: ")  # tools wait for that line as it is
            rospy.logwarn(said) if is_published else rospy.logwarn(PREFIX, said)

    def tell_objective(self, objective: Objective) -> None:
        """Tell that an objective is asked for."""
        rospy.loginfo("Objective created and set to ungrounded")
        limits = ", ".join(f"{quality} {limit:g}" for quality, limit in sorted(objective.limits.items()))
        self.tell(f"{objective.name} needs {objective.function} with {limits or 'no limits'}")

    def tell_level(self, fact: LevelFact) -> None:
        """Log a level in the form that published tools expect."""
        text = f"QA value received!\tTYPE: {fact.quality}\tVALUE: {fact.text}"
        if self._levels.admit(time.monotonic(), fact.quality, text):
            rospy.loginfo(text)
        if again := self._unobserved.observed(fact.quality):
            self.tell(again)

    def tell_stale(self, fact: StaleFact) -> None:
        """Warn of a quality that can't be observed."""
        if said := self._unobserved.stale(time.monotonic(), fact.quality, fact.reason):
            rospy.logwarn(PREFIX, said)

    def tell_remark(self, remark: Remark) -> None:
        """Warn of a diagnostic that makes no sense; tell once of one that concerns nobody."""
        if remark.is_warning:
            self.warn(remark.kind, remark.text)
        elif remark.text not in self._told and len(self._told) < _LONGEST:
            self._told.add(remark.text)
            self.tell(remark.text)

    def tell_decision(self, decision: Decision) -> None:
        """Log a decision or its outcome."""
        if decision.state == EXECUTED:
            rospy.loginfo("Exited timer_cb after successful reconfiguration")
            took = f"{decision.objective} has {decision.to_configuration} after {decision.execute_wall_s:.2f} s"
            self.tell(f"executed: {took} ({decision.id})")
        elif decision.state == FAILED and decision.to_configuration:
            rospy.logwarn(PREFIX, f"failed: {decision.explanation} ({decision.id})")
        else:
            (rospy.loginfo if decision.to_configuration else rospy.logwarn)(PREFIX, line(decision))
