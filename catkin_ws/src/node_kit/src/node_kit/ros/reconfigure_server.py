"""Servers of dynamic_reconfigure that neither a parameter nor a request leaves in disorder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import rospy

from node_kit.parameters import misfit

_WORDS = {bool: "true or false", int: "a whole number", str: "a text", float: "a number"}
_SHOWN = 100  # characters of a name or value


class Strict:
    """Goes before dynamic_reconfigure's Server in a list of bases: it refuses what the server does not have.

    That server takes names and types as they come. A value named `groups`, or a text where the parameter is a number,
    may stay in its settings, so that each later request fails, too.
    """

    type: Any  # as dynamic_reconfigure has them: the definition, present values, and the namespace with a slash
    config: Any
    ns: str

    def _copy_from_parameter_server(self) -> None:
        """Take the values with which the node starts.

        Raises:
            ParameterError: one can't be used.
        """
        super()._copy_from_parameter_server()  # type: ignore[misc]
        for name, default in self.type.defaults.items():
            if rule := _broken_rule(self.config[name], default):
                raise misfit(self.config[name], rospy.resolve_name(self.ns + name), rule)

    def _set_callback(self, request: Any) -> Any:
        """Answer a request (called by rospy). Its groups are those of a client's view, and left out.

        Raises:
            rospy.ServiceException: why it is refused.
        """
        if problem := problem_of(request.config, self.type.defaults):
            raise rospy.ServiceException(problem)
        request.config.groups = []
        return super()._set_callback(request)  # type: ignore[misc]


def problem_of(config: Any, defaults: Mapping[str, Any]) -> str:
    """Return what is wrong with the names or values of a request, in one line; empty: nothing.

    Args:
        config: a dynamic_reconfigure/Config.
        defaults: of the server's parameters, by name.
    """
    for values in (config.bools, config.ints, config.strs, config.doubles):
        for one in values:
            if one.name not in defaults:
                return f"there is no parameter {one.name[:_SHOWN]!r}: there are {', '.join(sorted(defaults))}"
            if rule := _broken_rule(one.value, defaults[one.name]):
                return f"{one.name} is {str(one.value)[:_SHOWN]!r}: it {rule}"
    return ""


def _broken_rule(value: Any, default: Any) -> str:
    """Return which rule a value breaks, where a parameter's type is that of its default; empty: none."""
    wanted = type(default)
    fits = type(value) is wanted or (wanted is float and type(value) is int)
    return "" if fits and value == value else f"must be {_WORDS[wanted]}"  # noqa: PLR0124 not a number
