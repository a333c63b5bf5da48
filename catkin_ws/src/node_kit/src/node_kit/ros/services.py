"""Calls of services of the running system, each with a deadline: rospy waits for an answer for ever."""

from __future__ import annotations

from concurrent.futures import wait
from functools import partial
from typing import Any

import rospy
from rospy.exceptions import TransportException

from node_kit.io.background import in_background

SERVICE_FAILURES = (rospy.ServiceException, rospy.ROSException, TransportException, OSError)
"""What a call of a service raises, also where its node ends during the call. A thread that the system refuses
(NoThreadError) is an OSError."""

FIND_S = 10.0
ANSWER_S = 20.0
"""Wall s for a service to be there, and then for its answer."""


def call(service: str, kind: type, /, *arguments: Any, **fields: Any) -> Any:
    """Return the answer of a service, to a request of a type with such fields.

    Raises:
        ROSException: it is not there, or does not answer, in time.
        ServiceException: the call has failed.
        NoThreadError: the system refuses a thread.
    """
    return call_within(FIND_S, service, kind, *arguments, **fields)


def call_within(find_s: float, service: str, kind: type, /, *arguments: Any, **fields: Any) -> Any:
    """Do the same with a service that is to be there within so many wall s."""
    name = rospy.resolve_name(service)
    answer = in_background(partial(_call, find_s, name, kind, *arguments, **fields), f"call {name}")
    if not wait([answer], find_s + ANSWER_S).done:
        raise rospy.ROSException(f"{name} has not answered within {ANSWER_S:g} s: look at the node that offers it")
    return answer.result()


def _call(find_s: float, name: str, kind: type, /, *arguments: Any, **fields: Any) -> Any:
    try:
        rospy.wait_for_service(name, find_s)
        return rospy.ServiceProxy(name, kind)(*arguments, **fields)
    except (TransportException, OSError) as error:  # they do not say of whom
        raise rospy.ServiceException(f"{name}: {error}") from error
