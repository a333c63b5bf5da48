"""Which parameters to set and to restore when one configuration takes the place of another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

_SHOWN = 5  # parameters in a message


def put_back(drifted: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """Return in words which parameters were put back.

    Args:
        drifted: the values that they had, by full name; None: they were not set.
        wanted: the values of the configuration.
    """
    words = [
        f"{name} ({'not set' if value is None else value}, not {wanted.get(name)})" for name, value in drifted.items()
    ]
    more = f" and {len(words) - _SHOWN} more" if len(words) > _SHOWN else ""
    return f"put back: {', '.join(words[:_SHOWN])}{more}"


class OverwrittenParameters:
    """The values that the parameter server had before configurations set others."""

    def __init__(self, before: Mapping[str, Any] | None = None, absent: Iterable[str] = ()) -> None:
        """Begin with what is known.

        Args:
            before: former values, by full name.
            absent: names of parameters that were not set.
        """
        self._before: dict[str, Any] = dict(before or {})
        self._absent: set[str] = set(absent)

    def unknown(self, wanted: Iterable[str]) -> list[str]:
        """Return the parameters whose former values `remember` must be told before they are set."""
        return [name for name in wanted if name not in self._before and name not in self._absent]

    def remember(self, asked: Iterable[str], found: Mapping[str, Any]) -> None:
        """Keep the former values of parameters; those in `asked` that are not in `found` were not set."""
        for name in asked:
            if name in found:
                self._before[name] = found[name]
            else:
                self._absent.add(name)

    def transition(self, wanted: Mapping[str, Any], others: Iterable[str] = ()) -> tuple[dict[str, Any], list[str]]:
        """Return the parameters to set and those to delete, so that no value of another configuration is left.

        Args:
            wanted: the parameters of the configuration to deploy.
            others: names of the parameters of other functions, which are left alone.
        """
        kept = {*wanted, *others}
        restored = {name: value for name, value in self._before.items() if name not in kept}
        return {**restored, **wanted}, sorted(self._absent - kept)

    def restored(self, wanted: Iterable[str], others: Iterable[str] = ()) -> bool:
        """Forget the former values that `transition` has had restored: others may set these parameters from now on.

        Args:
            wanted: names of the parameters of the configuration that was deployed.
            others: names of the parameters of other functions.

        Returns:
            Whether there were any.
        """
        kept = {*wanted, *others}
        gone = {*self._before, *self._absent} - kept
        self._before = {name: value for name, value in self._before.items() if name in kept}
        self._absent &= kept
        return bool(gone)

    def as_parameter(self) -> dict[str, list[Any]]:
        """Return the value of the parameter that hands this over to the next manipulator."""
        return {"before": [[name, value] for name, value in self._before.items()], "absent": sorted(self._absent)}

    @classmethod
    def from_parameter(cls, value: object) -> OverwrittenParameters:
        """Read the parameter; know nothing where it has another form."""
        try:
            before, absent = value["before"], value["absent"]  # type: ignore[index]
            return cls({str(name): former for name, former in before}, map(str, absent))
        except (KeyError, TypeError, ValueError):
            return cls()
