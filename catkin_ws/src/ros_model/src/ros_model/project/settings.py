"""`metacontrol.yaml` as checked data that knows where each value stands in the file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position
from ros_model.project.schema_check import Keys, dotted, load_schema, part_of, violations
from ros_model.project.yaml_file import parse_yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

FILE_NAME = "metacontrol.yaml"
_SCHEMA = "metacontrol"
FUNCTION_KEYS = ("save_action", "goal_msg_type", "kill_nodes")
"""What the manipulator has to heed while it changes a function."""


@dataclass(frozen=True)
class Settings:
    """The content of a metacontrol.yaml.

    Attributes:
        path: the file.
        content: what it says; the sections `components`, `observers` and `requires` are there even if empty.
    """

    path: Path
    content: dict[str, Any]
    _places: Mapping[Keys, Position] = field(repr=False, compare=False)

    def at(self, *keys: str | int) -> Position:
        """Return where the value stands to which the keys lead, or the nearest thing around it that there is."""
        while keys not in self._places and keys:
            keys = keys[:-1]
        return self._places.get(keys, Position(str(self.path), 1, 1))

    def error(self, message: str, *keys: str | int) -> ModelError:
        """Return an error about the value to which the keys lead."""
        return ModelError(f"{dotted(keys) or 'the file'}: {message}", self.at(*keys), rule="settings")

    def inside(self, *keys: str | int) -> Path:
        """Return the file that a value names, relative to this one, as this one was given: messages show both alike.

        Raises:
            ModelError: it leaves the folder.
        """
        name: Any = self.content
        for key in keys:
            name = name[key]
        folder = Path(os.path.realpath(self.path.parent))
        try:
            found = Path(os.path.realpath(folder / name))
        except ValueError:  # a character that no path has
            raise self.error(f"{name!r} is no name of a file", *keys) from None
        if not found.is_relative_to(folder):
            raise self.error(f"{name} leaves the folder of the models: move the file into it", *keys)
        return self.path.parent / name

    def within(self, keys: Keys) -> Callable[..., Position]:
        """Return what gives the position of a value within a section, from the keys inside that."""

        def where(*inner: str | int) -> Position:
            return self.at(*keys, *inner)

        return where

    @property
    def families(self) -> tuple[tuple[Keys, dict[str, Any]], ...]:
        """The families of variants, each with the keys that lead to it."""
        section = self.content["variants"]
        if isinstance(section, list):
            return tuple((("variants", number), family) for number, family in enumerate(section))
        return ((("variants",), section),)


def parse_settings(text: str, path: Path, sections: Sequence[str] = ()) -> tuple[Settings, tuple[ModelError, ...]]:
    """Return the settings that a text is, and what is wrong in them, in the order of the file.

    Args:
        text: the content of a metacontrol.yaml.
        path: the file.
        sections: check only these, and let the others be absent; all of them if empty.

    Raises:
        ModelError: it is no YAML.
    """
    value, places = parse_yaml(text, str(path))
    schema = load_schema(_SCHEMA)
    if sections:
        schema = part_of(schema, *sections)
    content = value if isinstance(value, dict) else {}
    settings = Settings(path, {"components": {}, "observers": [], "requires": {}, **content}, places)
    found = [settings.error(violation.message, *violation.keys) for violation in violations(value, schema)]
    if not found and not sections:
        found = list(_broken_links(settings))
    return settings, tuple(sorted(found, key=_place))


def _place(error: ModelError) -> tuple[int, int]:
    return (error.position.line, error.position.column) if error.position else (0, 0)


def _broken_links(settings: Settings) -> Iterator[ModelError]:
    """Yield names in one section that do not stand in the other that they refer to."""
    content = settings.content
    yield from _unknown_qas(settings)
    for name, function in content["functions"].items():
        requires = function.get("requires", [])
        for design, required in requires.items() if isinstance(requires, dict) else [(None, requires)]:
            for number, other in enumerate(required):
                keys = ("functions", name, "requires", *([] if design is None else [design]), number)
                if other not in content["functions"]:
                    yield _no_such(settings, other, "functions", *keys)
                elif other == name:
                    yield settings.error("a function can't require itself: take it out", *keys)
    yield from _cycle(settings)
    yield from _unclear_functions(settings)
    for name, objective in content["objectives"].items():
        if objective["function"] not in content["functions"]:
            yield _no_such(settings, objective["function"], "functions", "objectives", name, "function")
    yield from _unordered(settings)
    yield from _unclear_repairs(settings)
    seen: set[str] = set()
    for number, entry in enumerate(content["observers"]):
        name = entry["name"] if isinstance(entry, dict) else entry
        if name in seen:
            yield settings.error(f"{name!r} stands twice: take one out", "observers", number)
        seen.add(name)
        if isinstance(entry, dict):
            yield from _ascending(settings, entry["range"], "observers", number, "range")
            if "outputs" in entry and "plugin" not in entry:
                yield settings.error(
                    "is for an observer that exists: name it as plugin", "observers", number, "outputs"
                )


def _cycle(settings: Settings) -> Iterator[ModelError]:
    """Yield functions that require each other, directly or through others: none of them could be the first to run."""
    required: dict[str, set[str]] = {}
    for name, function in settings.content["functions"].items():
        requires = function.get("requires", [])
        lists = requires.values() if isinstance(requires, dict) else [requires]
        required[name] = {other for others in lists for other in others if other != name}
    try:
        TopologicalSorter(required).prepare()
    except CycleError as error:
        first, *others = reversed(error.args[1])
        cycle = " requires ".join([first, *others])
        yield settings.error(f"functions require each other ({cycle}): take one out", "functions", first, "requires")


def _unclear_functions(settings: Settings) -> Iterator[ModelError]:
    """Yield keys of `manipulator` that do not say which function they are for, and actions without a type."""
    functions = settings.content["functions"]
    for key in FUNCTION_KEYS:
        if key in settings.content.get("manipulator", {}) and (
            len(functions) > 1 or key in next(iter(functions.values()))
        ):
            yield settings.error("put it under functions/NAME, so that it is clear for which one", "manipulator", key)
    for name, entry in functions.items():
        if "save_action" in entry and "goal_msg_type" not in entry:
            yield settings.error("has no goal_msg_type: add the action's type", "functions", name, "save_action")


def _unclear_repairs(settings: Settings) -> Iterator[ModelError]:
    """Yield repairs that do not say by what means, or that say two."""
    for name, entry in settings.content["components"].items():
        means = [key for key in ("service", "launch") if key in entry.get("repair", {})]
        if "repair" in entry and len(means) != 1:
            wrong = "has both service and launch: take one out" if means else "has neither service nor launch: add one"
            yield settings.error(wrong, "components", name, "repair")


def _unknown_qas(settings: Settings) -> Iterator[ModelError]:
    content = settings.content
    utility = content["utility"]
    used: list[tuple[str, Keys]] = [(utility, ("utility",))] if isinstance(utility, str) else []
    qualities = content["quality_attributes"]
    used += [(e["typical"], ("quality_attributes", q, "typical")) for q, e in qualities.items() if "typical" in e]
    for name, objective in content["objectives"].items():
        used += [(qa, ("objectives", name, "nfrs", qa)) for qa in objective.get("nfrs", {})]
    for number, entry in enumerate(content["observers"]):
        if isinstance(entry, dict):
            used.append((entry["quality_attribute"], ("observers", number, "quality_attribute")))
    for keys, family in settings.families:
        used += [(qa, (*keys, "expected", column)) for column, qa in family.get("expected", {}).items()]
    surroundings = content.get("environment", {})
    for qa, keys in used:
        if qa not in content["quality_attributes"] and not (keys[0] == "observers" and qa in surroundings):
            yield _no_such(settings, qa, "quality_attributes", *keys)


def _unordered(settings: Settings) -> Iterator[ModelError]:
    """Yield ranges and bands that do not begin with the lower number."""
    for name, entry in settings.content["quality_attributes"].items():
        yield from _ascending(settings, entry.get("range"), "quality_attributes", name, "range")
    for name, entry in settings.content["objectives"].items():
        for quality, limit in entry.get("nfrs", {}).items():
            band = limit if isinstance(limit, list) else None
            yield from _ascending(settings, band, "objectives", name, "nfrs", quality)


def _ascending(settings: Settings, limits: list[float] | None, *keys: str | int) -> Iterator[ModelError]:
    if limits and not limits[0] < limits[1]:
        yield settings.error(f"is '{limits}', must be a list of two numbers, the lower one first", *keys)


def _no_such(settings: Settings, name: str, section: str, *keys: str | int) -> ModelError:
    known = ", ".join(sorted(settings.content[section]))
    return settings.error(f"{name!r} is none of {section}: {known}", *keys)
