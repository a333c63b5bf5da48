"""The parameter by which an action's server takes over the goal of an earlier one.

The program that restarts the server of ACTION sets the parameter `ACTION/resume_goal` to `{type:
"move_base_msgs/MoveBaseActionGoal", data: BASE64}`, the serialised action goal. The new server then knows the goal
before its first status message; the client sees no gap. It deletes the parameter just before that, not when it reads
it: where it is killed while it starts, the next one takes the goal over.
"""

from __future__ import annotations

import base64
import binascii

from node_kit.one_line import OneLineError

MAX_LENGTH = 100_000
"""Longest accepted text; a goal takes about 300 characters."""


class TakeoverError(OneLineError, ValueError):
    """The parameter does not hold a goal; the message says why."""


def decode_parameter(value: object, goal_type: str) -> bytes:
    """Return the serialised action goal in the parameter's value.

    Args:
        value: of the parameter.
        goal_type: of the action goal that is expected, such as "move_base_msgs/MoveBaseActionGoal".

    Raises:
        TakeoverError: the value has another form.
    """
    if not isinstance(value, dict):
        raise TakeoverError(f"must have type and data, is {type(value).__name__}")
    if value.get("type") != goal_type:
        raise TakeoverError(f"type must be {goal_type}, is {value.get('type')!r}")
    data = value.get("data")
    if not isinstance(data, str) or not data or len(data) > MAX_LENGTH:
        raise TakeoverError("data must be a base64 text")
    try:
        return base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise TakeoverError(f"data is not base64: {error}") from error
