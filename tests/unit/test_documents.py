"""Documents of the project: what they name is there. `./mros lint links` follows their links."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "catkin_ws" / "src"


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_modules_and_rooms_that_are_named_exist(name):
    packages = "|".join(path.parent.name for path in SOURCE.glob("*/package.xml"))
    text = (ROOT / name).read_text(encoding="utf-8")
    named = re.findall(rf"`({packages})/([\w/.]*(?:/|\.py))`", text)
    assert named
    assert not [
        path for path in named if not any((SOURCE / path[0] / s / path[1]).exists() for s in ("", f"src/{path[0]}"))
    ]


def test_the_architecture_lists_the_rooms_of_every_package():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for source in SOURCE.glob("*/src/*"):
        rooms = {path.parent.name for path in source.glob("*/__init__.py")}
        row = next(line for line in text.splitlines() if re.match(rf"\|[^|]*`{source.name}`[^|]*\|.*\|.*\|$", line))
        assert set(re.findall(r"`(\w+)/`", row)) == rooms, row


def test_every_decision_is_in_the_index():
    index = (ROOT / "docs" / "decisions" / "README.md").read_text(encoding="utf-8")
    records = sorted(path.name for path in (ROOT / "docs" / "decisions").glob("[0-9]*.md"))
    assert re.findall(r"\((\d{4}-[^)]+\.md)\)", index) == records


@pytest.mark.parametrize(
    "file", sorted(SOURCE.glob("*/launch/*.launch")), ids=lambda path: str(path.relative_to(SOURCE))
)
def test_the_reference_has_the_arguments_of_every_launch_file(file):
    text = (ROOT / "docs" / "reference" / "launch-files.md").read_text(encoding="utf-8")
    section = text.partition(f"## {file.parents[1].name} {file.name}\n")[2].partition("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    launch = ET.parse(file).getroot()  # noqa: S314 our own file
    assert rows == [row(argument) for argument in launch.findall("arg")]


def row(argument):
    """Return an argument of a launch file as a row of the reference."""
    default = argument.get("default")
    shown = "required" if default is None else f"`{default}`" if default else '""'
    what = argument.get("doc", "").replace("|", "/").replace("<", "&lt;")
    return f"| `{argument.get('name')}` | {shown} | {what} |"
