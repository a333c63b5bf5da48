"""The project of a robot: `metacontrol.yaml` and the models that it names, checked and read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from ros_model import variants
from ros_model.errors import ModelError
from ros_model.files import read_text
from ros_model.metamodel import RosSystem, compose
from ros_model.reader import read_system

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

FILE_NAME = "metacontrol.yaml"
DIRECTIONS = ("lower_is_better", "higher_is_better")
_Check = "Callable[[Any, str], None]"


@dataclass(frozen=True)
class Project:
    """A base system, its variants and what metacontrol.yaml says about them.

    Attributes:
        folder: the folder of metacontrol.yaml; the paths in it are relative to this.
        settings: the content of metacontrol.yaml, checked.
        base: the system without the choices that variants make.
        variants: one partial system each, composed with the base (metamodel.compose).
    """

    folder: Path
    settings: dict[str, Any]
    base: RosSystem
    variants: tuple[RosSystem, ...]

    @property
    def package(self) -> str:
        """Name of the catkin package that holds the models and what is generated from them."""
        return str(self.settings["package"])

    def designs(self, function: str) -> tuple[RosSystem, ...]:
        """Return the variants that solve a function."""
        names = self.settings["functions"][function]["designs"]
        return tuple(v for v in self.variants if names == "all" or v.name in names)

    def function_of(self, variant: str) -> str:
        """Return the function that a variant solves.

        Raises:
            ModelError: no function names it among its designs.
        """
        for function in self.settings["functions"]:
            if any(design.name == variant for design in self.designs(function)):
                return str(function)
        raise ModelError(f"{self.folder / FILE_NAME}: no function has {variant} among its designs: add it to one")

    def required_components(self) -> dict[str, frozenset[str]]:
        """Return, for each variant, the components that it can't do without: by its wiring, and by `requires`."""
        by_value = self.settings.get("requires", {})
        return {
            variant.name: required_components(self.base, variant) | required_by_parameters(variant, by_value)
            for variant in self.variants
        }


def load_project(folder: str | Path) -> Project:
    """Read a folder's metacontrol.yaml, or that file itself, and the models that it names.

    Variants come from the table that it names; without one, from the `.rossystem` files of `variants/`.

    Raises:
        ModelError: a file is missing or wrong; says which, and which key.
    """
    path = Path(folder)
    path = path / FILE_NAME if path.is_dir() else path
    settings = _read_settings(path)
    folder = path.parent.resolve()
    base = read_system(_inside(folder, settings["base"], path, "base"))
    section = settings["variants"]
    if "table" in section:
        table = _inside(folder, section["table"], path, "variants.table")
        qa = _inside(folder, section["qa"], path, "variants.qa") if "qa" in section else None
        found = variants.make_variants(base, section, table, qa, path)
    else:
        found = tuple(read_system(file) for file in sorted((folder / "variants").glob("*.rossystem")))
        if not found:
            raise ModelError(f"{path}: variants: no table is named, and {folder / 'variants'} holds no .rossystem file")
    project = Project(folder, settings, base, found)
    _check_names(project, path)
    return project


def required_components(base: RosSystem, variant: RosSystem) -> frozenset[str]:
    """Return the components of the base that feed the variant's, directly or through others.

    The search stops at a component that the variant itself drives: that one is the plant (a robot's base takes
    the velocity and gives the odometry). It is needed, but the variant doesn't depend on whatever else acts on it.
    """
    system = compose(base, variant)
    own = {component.name for component in variant.components}
    feeds: dict[str, set[str]] = {}
    for connection in system.connections:
        for target in connection.targets:
            feeds.setdefault(target.component, set()).update(source.component for source in connection.sources)
    driven = {target for target, sources in feeds.items() if sources & own}
    required: set[str] = set()
    waiting = list(own)
    while waiting:
        for source in feeds.get(waiting.pop(), ()):
            if source not in required | own:
                required.add(source)
                if source not in driven:
                    waiting.append(source)
    return frozenset(required)


def required_by_parameters(variant: RosSystem, requires: Mapping[str, Mapping[str, str]]) -> frozenset[str]:
    """Return the components that a variant's parameter values ask for, for models that have no wiring.

    Args:
        variant: the system.
        requires: parameter (its key, or the key's last part) -> value -> component. A value of the variant may be
            several, separated by blanks, as in costmap_2d's observation_sources.
    """
    found: set[str] = set()
    for component in variant.components:
        for parameter in component.parameters:
            choices = requires.get(parameter.key) or requires.get(parameter.key.rsplit("/", 1)[-1]) or {}
            found.update(choices[value] for value in str(parameter.value).split() if value in choices)
    return frozenset(found)


def _inside(folder: Path, relative: str, path: Path, key: str) -> Path:
    found = (folder / relative).resolve()
    if not found.is_relative_to(folder):
        raise ModelError(f"{path}: {key}: {relative} leaves the folder of the models: move the file into it")
    return found


def _read_settings(path: Path) -> dict[str, Any]:
    text = read_text(path)
    try:
        settings = yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else str(path)
        what = getattr(error, "problem", None) or "is no YAML: check its first lines"
        raise ModelError(f"{where}: {what}") from error
    try:
        _SETTINGS(settings, "")
    except _SchemaError as error:
        raise ModelError(f"{path}: {error}") from None
    _check_links(settings, path)
    return dict(settings)


def _check_links(settings: Mapping[str, Any], path: Path) -> None:
    """Check that what one section names stands in another."""
    functions, qas = settings["functions"], settings["quality_attributes"]
    if settings["utility"] not in qas:
        raise ModelError(f"{path}: utility: {settings['utility']!r} is none of quality_attributes: {_names(qas)}")
    for name, function in functions.items():
        for required in function.get("requires", ()):
            if required not in functions:
                raise ModelError(
                    f"{path}: functions.{name}.requires: {required!r} is none of functions: {_names(functions)}"
                )
    for name, objective in settings["objectives"].items():
        if objective["function"] not in functions:
            raise ModelError(
                f"{path}: objectives.{name}.function: {objective['function']!r} is none of functions: "
                f"{_names(functions)}"
            )
        for qa in objective.get("nfrs", {}):
            if qa not in qas:
                raise ModelError(f"{path}: objectives.{name}.nfrs: {qa!r} is none of quality_attributes: {_names(qas)}")


def _check_names(project: Project, path: Path) -> None:
    known = {variant.name for variant in project.variants}
    if len(known) < len(project.variants):
        raise ModelError(f"{path}: two variants bear the same name: rename one")
    for name, function in project.settings["functions"].items():
        for design in function["designs"] if function["designs"] != "all" else ():
            if design not in known:
                raise ModelError(f"{path}: functions.{name}.designs: {design!r} is none of the {len(known)} variants")


def _names(names: Mapping[str, Any]) -> str:
    return ", ".join(sorted(map(str, names)))


class _SchemaError(Exception):
    """A value of metacontrol.yaml is not as it must be; says the key and what is allowed."""


def _fail(key: str, allowed: str, value: Any) -> None:
    found = "is missing" if value is None else f"is {str(value)[:40]!r}"
    raise _SchemaError(f"{key or 'the file'}: {found}, must be {allowed}")


def _text(value: Any, key: str) -> None:
    if not isinstance(value, str) or not value:
        _fail(key, "a name", value)


def _number(value: Any, key: str) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        _fail(key, "a finite number", value)


def _range(value: Any, key: str) -> None:
    if not isinstance(value, list) or len(value) != 2:
        _fail(key, "a list of two numbers, [lowest, highest]", value)
    for number in value:
        _number(number, key)
    if not value[0] < value[1]:
        _fail(key, "a list of two numbers, the lower one first", value)


def _one_of(*allowed: str) -> Callable[[Any, str], None]:
    def check(value: Any, key: str) -> None:
        if value not in allowed:
            _fail(key, " or ".join(allowed), value)

    return check


def _list(item: Callable[[Any, str], None]) -> Callable[[Any, str], None]:
    def check(value: Any, key: str) -> None:
        if not isinstance(value, list):
            _fail(key, "a list", value)
        for number, entry in enumerate(value):
            item(entry, f"{key}[{number}]")

    return check


def _map(item: Callable[[Any, str], None]) -> Callable[[Any, str], None]:
    def check(value: Any, key: str) -> None:
        if not isinstance(value, dict):
            _fail(key, "a mapping of names", value)
        for name, entry in value.items():
            _text(name, f"{key}: the key {name!r}")
            item(entry, f"{key}.{name}")

    return check


def _record(
    required: Mapping[str, Callable[[Any, str], None]], optional: Mapping[str, Callable[[Any, str], None]] | None = None
) -> Callable[[Any, str], None]:
    known = {**required, **(optional or {})}

    def check(value: Any, key: str) -> None:
        if not isinstance(value, dict):
            _fail(key, f"a mapping with {', '.join(required or known)}", value)
        prefix = f"{key}." if key else ""
        for name in value:
            if name not in known:
                raise _SchemaError(f"{prefix}{name}: unknown key, allowed here: {', '.join(known)}")
        for name, item in known.items():
            if name in value or name in required:
                item(value.get(name), prefix + name)

    return check


def _designs(value: Any, key: str) -> None:
    if value != "all":
        if not isinstance(value, list):
            _fail(key, "'all' or a list of variants", value)
        _list(_text)(value, key)


def _component(value: Any, key: str) -> None:
    _record({}, {"node": _text, "topic": _text})(value, key)
    if len(value) != 1:
        _fail(key, "a mapping with either node or topic", value)


_SETTINGS = _record(
    {
        "package": _text,
        "base": _text,
        "variants": _record(
            {"component": _text},
            {
                "table": _text,
                "qa": _text,
                "parameters": _map(_list(_record({"name": _text}, {"factor": _number}))),
                "connections": _map(_map(_list(_text))),
            },
        ),
        "functions": _map(_record({"designs": _designs}, {"requires": _list(_text)})),
        "quality_attributes": _map(_record({"direction": _one_of(*DIRECTIONS)}, {"range": _range})),
        "utility": _text,
        "objectives": _map(_record({"function": _text}, {"nfrs": _map(_number)})),
        "components": _map(_component),
    },
    {
        "observers": _list(_text),
        "manipulator": _record(
            {}, {"save_action": _text, "goal_msg_type": _text, "kill_nodes": _list(_text), "action_name": _text}
        ),
        "requires": _map(_map(_text)),
    },
)
