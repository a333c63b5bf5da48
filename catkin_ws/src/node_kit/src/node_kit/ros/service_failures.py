"""How calls of services fail."""

from __future__ import annotations

import rospy
from rospy.exceptions import TransportException

SERVICE_FAILURES = (rospy.ServiceException, rospy.ROSException, TransportException, OSError)
"""What a call of a service raises, also where its node ends during the call. A thread that the system refuses
(NoThreadError) is an OSError."""
