"""Calls of services of the running system, each with a deadline: rospy waits for an answer for ever."""

from __future__ import annotations

from concurrent.futures import wait
from functools import partial
from typing import Any

import rospy
from node_kit.io.background import in_background
from rospy.exceptions import TransportException

FIND_S = 10.0
ANSWER_S = 20.0
"""Wall s for a service to be there, and then for its answer."""


def call(service: str, kind: type, /, *arguments: Any, **fields: Any) -> Any:
    """Return the answer of a service.

    Raises:
        ROSException: it is not there, or does not answer, in time.
        ServiceException, OSError: the call has failed.
    """
    name = rospy.resolve_name(service)
    answer = in_background(partial(_call, name, kind, *arguments, **fields), f"call {name}")
    if not wait([answer], FIND_S + ANSWER_S).done:
        raise rospy.ROSException(f"{name} has not answered within {ANSWER_S:g} s: look at the node that offers it")
    return answer.result()


def _call(name: str, kind: type, /, *arguments: Any, **fields: Any) -> Any:
    rospy.wait_for_service(name, FIND_S)
    try:
        return rospy.ServiceProxy(name, kind)(*arguments, **fields)
    except TransportException as error:
        raise rospy.ServiceException(f"{name}: {error}") from error
