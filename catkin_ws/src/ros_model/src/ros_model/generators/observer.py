"""Generates observers of quality attributes: their model, a plug-in of rosgraph_monitor, and a test beside it.

The model, models/observers.ros, is written anew each time. The plug-in and its test are the developer's once they are
there: one that exists is left alone.
"""

from __future__ import annotations

import ast
import math
import os
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.generators import MARK, write_files
from ros_model.language.packages_writer import write_packages
from ros_model.project.observers import described_observers, observer_packages, variables

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.project.observers import ObserverModel
    from ros_model.project.project import Project

MODEL = Path("models") / "observers.ros"
_TEMPLATES = Path(__file__).parent / "templates"
_HEADER = f"{MARK} generate observer`; change metacontrol.yaml, not this."
_VARIABLES = {"LOWEST": "range", "HIGHEST": "range", "qa_name": "quality_attribute", "max_age": "max_age"}
_WORST = {"lower_is_better": "lower is better", "higher_is_better": "higher is better"}
_OF_A_QUALITY = {
    "bases": "TopicObserver",
    "lowest_is": "Value of the formula that is level 0 of $quality",
    "highest_is": "Value of the formula that is level 1 of $quality; $direction",
    "level": "the level of $quality, 0 to 1,",
    "status_of": '''\
        """Return the diagnostics of a value: its level, 0 at LOWEST and 1 at HIGHEST; values beyond are clipped."""
        return self.qa_status(min(max((value - LOWEST) / (HIGHEST - LOWEST), 0.0), 1.0))''',
}
_OF_THE_SURROUNDINGS = {
    "bases": "StaleInputError, TopicObserver",
    "lowest_is": "The least value of $quality that makes sense, in the unit of the limits of designs",
    "highest_is": "The greatest value of $quality that makes sense; $direction",
    "level": "the value of $quality",
    "status_of": '''\
        """Return the diagnostics of a value, which is told as it is; one that makes no sense is stale."""
        if not LOWEST <= value <= HIGHEST:
            raise StaleInputError(f"$quality {value} is not from {LOWEST} to {HIGHEST}")
        return self.qa_status(value)''',
}
"""What the templates say of either kind of observer."""


def generate(project: Project, output: Path) -> list[Path]:
    """Write the model of the observers that metacontrol.yaml describes, and what is not there yet of their code.

    Raises:
        ModelError: rate or range of one is none, or a file can't be written.
    """
    observers = described_observers(project)
    return write_observers(observers, output) if observers else []


def write_observers(observers: Iterable[ObserverModel], output: Path) -> list[Path]:
    """Write the model of observers, and plug-in and test of each that has none; return the files written.

    Raises:
        ModelError: rate or range of one is none, or a file can't be written.
    """
    observers = tuple(observers)
    for observer in observers:
        _check_numbers(observer)
    texts = {output / MODEL: write_packages(observer_packages(observers, _HEADER))}
    for observer in observers:
        if observer.plugin:
            continue
        plugin = plugin_path(observer, output)
        code = {
            plugin.parent / "__init__.py": "",
            plugin: plugin_text(observer),
            output / "test" / f"test_{observer.module}.py": test_text(observer),
        }
        texts |= {path: text for path, text in code.items() if not os.path.exists(path)}
    return write_files(texts, output)


def _check_numbers(observer: ObserverModel) -> None:
    """Refuse numbers that Python source cannot express, or that give no level."""
    rate, lowest, highest = observer.rate, observer.lowest, observer.highest
    if not (0 < rate < math.inf and -math.inf < lowest < highest < math.inf):
        raise ModelError(
            f"observer {observer.name}: rate {rate} and range [{lowest}, {highest}]: give finite numbers, "
            "the rate over 0 and the lower end of the range first"
        )


def missing_exports(observers: Iterable[ObserverModel], output: Path) -> list[str]:
    """Return the lines that the package.xml of the output, which may have one <export>, lacks for the monitor."""
    manifest = output / "package.xml"
    text = manifest.read_text(encoding="utf-8", errors="replace") if os.path.isfile(manifest) else ""
    tags = [o.export_tag for o in observers if not o.plugin and f'"{o.target}"' not in text]
    if "<export>" in text:
        return [f"{tag} inside its <export>" for tag in tags]
    return [f"<export>{''.join(tags)}</export>"] if tags else []


def plugin_path(observer: ObserverModel, output: Path) -> Path:
    """Return where the plug-in of an observer is written."""
    return output / "src" / observer.python_package / f"{observer.module}.py"


def outdated(observers: Iterable[ObserverModel], output: Path) -> list[str]:
    """Return the plug-ins that differ from what would be generated now, each with the differences."""
    found = []
    for observer in observers:
        path = plugin_path(observer, output)
        if observer.plugin or not os.path.isfile(path):
            continue
        now = _described(plugin_text(observer), observer.name)
        kept = _described(path.read_text(encoding="utf-8", errors="replace"), observer.name)
        if changed := [part for part in kept if kept[part] != now[part]]:
            parts = ", ".join(sorted(changed))
            found.append(f"{path} with another {parts}: correct that, or delete it to have it made anew")
    return found


def _described(text: str, name: str) -> dict[str, list[str]]:
    """Return what the text of a plug-in says of topics, rate, ..., as far as it says so as a generated one does."""
    try:
        module = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return {}
    classes = [node for node in module.body if isinstance(node, ast.ClassDef) and node.name == name]
    said: dict[str, list[str]] = {"max_age": []} if classes else {}
    for node in (*module.body, *(inner for found in classes for inner in ast.walk(found))):
        match node:
            case ast.Assign([ast.Name(variable)], value) if variable in _VARIABLES:
                said.setdefault(_VARIABLES[variable], []).append(ast.unparse(value))
            case ast.Call(ast.Attribute(ast.Call(ast.Name("super")), "__init__"), [_, rate, topics]):
                said |= {"rate": [ast.unparse(rate)], "topics": [ast.unparse(topics)]}
    return said


def plugin_text(observer: ObserverModel) -> str:
    """Return the module of the plug-in, with `calculate_attr` left to write."""
    names = variables(topic for topic, _ in observer.topics)
    unpacked = [
        f"        {name} = msgs[{number}]  # {kind} from {topic}"
        for number, (name, (topic, kind)) in enumerate(zip(names, observer.topics, strict=True))
    ]
    max_age = "" if observer.max_age is None else f"    max_age = {float(observer.max_age)!r}  # s\n"
    return _filled(
        "observer.py.template",
        observer,
        max_age=max_age,
        unpacked="\n".join(unpacked),
        names=", ".join(names),
    )


def test_text(observer: ObserverModel) -> str:
    """Return the test of the plug-in, which fails until the plug-in is written."""
    messages = "".join(f"{_python_type(kind)}(), " for _, kind in observer.topics)
    return _filled("test_observer.py.template", observer, messages=messages.removesuffix(" ").removesuffix(",") + ",")


test_text.__test__ = False  # type: ignore[attr-defined]  # no test of ours, whatever imports it


def _filled(template: str, observer: ObserverModel, **more: str) -> str:
    packages = sorted({kind.partition("/")[0] for _, kind in observer.topics})
    topics = ", ".join(f'("{topic}", {_python_type(kind)})' for topic, kind in observer.topics)
    direction = _WORST.get(observer.direction, "a property of the surroundings")
    kind = _OF_A_QUALITY if observer.direction else _OF_THE_SURROUNDINGS
    told = {"quality": observer.quality_attribute, "direction": direction}
    values = {
        **{name: Template(text).substitute(told) for name, text in kind.items()},
        "name": observer.name,
        "module": f"{observer.python_package}.{observer.module}",
        "quality": observer.quality_attribute,
        "direction": direction,
        "export": f"<export>{observer.export_tag}</export>",
        "imports": "\n".join(f"import {package}.msg" for package in packages),
        "topics": topics,
        "rate": repr(observer.rate),
        "lowest": repr(observer.lowest),
        "highest": repr(observer.highest),
        **more,
    }
    return Template((_TEMPLATES / template).read_text(encoding="utf-8")).substitute(values)


def _python_type(kind: str) -> str:
    package, _, name = kind.partition("/")
    return f"{package}.msg.{name}"
