"""The wizard of `rosmodel generate observer`: asks what to observe, then generates it."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from ros_model.cli.ranges import FiniteRange
from ros_model.errors import ModelError
from ros_model.generators import write_file
from ros_model.generators.observer import missing_exports, outdated, plugin_path, write_observers
from ros_model.generators.signals import Signal, signals
from ros_model.io.files import read_text
from ros_model.io.project import load_project, problems_of
from ros_model.language.packages import SpecKind
from ros_model.project.observers import camel_case, described_observers, observer_model
from ros_model.project.project import DIRECTIONS
from ros_model.project.settings import FILE_NAME
from ros_model.project.yaml_file import flow, with_entry

if TYPE_CHECKING:
    from collections.abc import Callable

    from ros_model.language.library import Library
    from ros_model.project.project import Project

_QUALITY = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_TOPIC = re.compile(r"[/A-Za-z][A-Za-z0-9_/]*")


def run_wizard(output: str | None = None) -> None:
    """Ask for an observer, add it to metacontrol.yaml if wanted, and generate its model, plug-in and test.

    Args:
        output: the package to write into; asked for if None.

    Raises:
        ModelError: a model can't be read, or a file not written.
    """
    project = _ask_project()
    settings = project.settings
    click.echo(f"Quality attributes so far: {', '.join(settings['quality_attributes'])}")
    quality = _ask("Quality attribute to observe", _checked(_quality, project))
    known = settings["quality_attributes"].get(quality)
    name = _ask("Class of the observer", _checked(_class, project), f"{camel_case(quality)}QualityObserver")
    topics = _ask_topics(signals(project.whole_base, project.library), project.library)
    rate = click.prompt("Evaluations per second", type=FiniteRange(min=0, min_open=True, max=1000), default=10.0)
    is_new = known is None and quality not in settings.get("environment", {})
    direction = _ask_direction() if is_new else (known or {}).get("direction", "")
    lowest = click.prompt("Value of your formula that is level 0", type=FiniteRange(-1e9, 1e9), default=0.0)
    highest = click.prompt(
        "Value of your formula that is level 1", type=FiniteRange(lowest, 1e9, min_open=True), default=lowest + 1.0
    )
    entry = {"name": name, "quality_attribute": quality, "topics": topics, "rate": rate, "range": [lowest, highest]}
    folder = Path(output or click.prompt("Package to write into", default=str(_package_of(project))))
    _add_to_settings(project, entry, direction if is_new else None)
    observer = observer_model(entry, project.package, direction)
    others = [other for other in described_observers(project) if other.name != name]
    for path in write_observers([*others, observer], folder):
        click.echo(f"wrote {path}")
    for line in outdated([observer], folder):
        click.echo(f"kept {line}")
    for line in missing_exports([observer], folder):
        click.echo(f"add to {folder / 'package.xml'}: {line}")
    click.echo(f"Now write calculate_attr in {plugin_path(observer, folder)}")


def _ask(text: str, check: Callable[[str], str], default: str | None = None) -> str:
    return cast(str, click.prompt(text, value_proc=check, default=default))


def _checked(check: Callable[[str, Project], str | None], project: Project) -> Callable[[str], str]:
    """Return what click asks again with, where the check finds something wrong."""

    def proc(text: str) -> str:
        if problem := check(text.strip(), project):
            raise click.BadParameter(problem)
        return text.strip()

    return proc


def _quality(text: str, _project: Project) -> str | None:
    return None if _QUALITY.fullmatch(text) else "a name of letters, digits and '_'"


def _class(text: str, project: Project) -> str | None:
    used = {entry["name"] if isinstance(entry, dict) else entry for entry in project.settings["observers"]}
    if text in used:
        return "an observer of this name is there already"
    return None if text.isidentifier() and text.isascii() else "the name of a Python class"


def _ask_project() -> Project:
    here = next((folder for folder in ("models", ".") if os.path.isfile(Path(folder) / FILE_NAME)), None)

    def proc(text: str) -> Project:
        try:
            return load_project(text)
        except ModelError as error:
            raise click.BadParameter(str(error)) from None

    return cast("Project", click.prompt("Folder of the models", value_proc=proc, default=here))


def _ask_topics(known: list[Signal], library: Library) -> dict[str, str]:
    """Return the topics to listen to with their types: picked by number from the model, or named."""
    click.echo("Signals in the model:")
    for number, signal in enumerate(known, 1):
        click.echo(f"{number:4}  {signal.topic}  {signal.type or '(type not in the models)'}  from {signal.component}")

    def proc(text: str) -> list[Signal]:
        chosen = []
        for word in re.split(r"[\s,]+", text.strip()):
            if word.isascii() and word.isdecimal():
                if not 1 <= int(word) <= len(known):
                    raise click.BadParameter(f"{word} is none of the numbers 1 to {len(known)}")
                chosen.append(known[int(word) - 1])
            elif _TOPIC.fullmatch(word):
                chosen.append(next((signal for signal in known if signal.topic == word), Signal(word, "", "")))
            else:
                raise click.BadParameter(f"{word!r} is neither a number of the list nor the name of a topic")
        return chosen

    chosen = click.prompt("Topics to listen to (numbers or names)", value_proc=proc)
    return {signal.topic: signal.type or _ask_type(signal.topic, library) for signal in chosen}


def _ask_type(topic: str, library: Library) -> str:
    def proc(text: str) -> str:
        name = text.strip().replace(".", "/", 1)
        if unknown := library.missing_type(SpecKind.TOPIC, name):
            raise click.BadParameter(unknown.message)
        return name

    return cast(str, click.prompt(f"Message type of {topic}, e.g. sensor_msgs/Imu", value_proc=proc))


def _ask_direction() -> str:
    return cast(str, click.prompt("Direction", type=click.Choice(DIRECTIONS), default=DIRECTIONS[0]))


def _package_of(project: Project) -> Path:
    folder = project.folder.parent
    here = Path.cwd()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder


def _add_to_settings(project: Project, entry: dict[str, Any], direction: str | None) -> None:
    """Add the observer, and a new quality attribute, to metacontrol.yaml, or say what to add."""
    path = project.source.path
    additions: list[tuple[str, str | None, Any]] = [("observers", None, entry)]
    if direction:
        additions.append(("quality_attributes", entry["quality_attribute"], {"direction": direction}))
    if click.confirm(f"Add it to {path}?", default=True):
        before = read_text(path)
        text = before
        for key, name, value in additions:
            text = with_entry(text, key, name, value)
        write_file(path, text, path.parent)
        if _is_sound(path):
            click.echo(f"added to {path}")
            return
        write_file(path, before, path.parent)  # an unusual layout: leave it to people
    click.echo(f"Put this into {path}:")
    for key, name, value in additions:
        click.echo(f"{key}:\n  {f'{name}: ' if name else '- '}{flow(value)}")


def _is_sound(path: Path) -> bool:
    try:
        return not problems_of(path)
    except ModelError:
        return False
