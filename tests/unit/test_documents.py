"""Documents of the project: what they name is there. `./mros lint links` follows their links."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_modules_and_rooms_that_are_named_exist(name):
    source = ROOT / "catkin_ws" / "src"
    packages = "|".join(path.parent.name for path in source.glob("*/package.xml"))
    text = (ROOT / name).read_text(encoding="utf-8")
    named = re.findall(rf"`({packages})/([\w/.]*(?:/|\.py))`", text)
    assert named
    assert not [
        path for path in named if not any((source / path[0] / s / path[1]).exists() for s in ("", f"src/{path[0]}"))
    ]


def test_the_architecture_lists_the_rooms_of_every_package():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for source in (ROOT / "catkin_ws" / "src").glob("*/src/*"):
        rooms = {path.parent.name for path in source.glob("*/__init__.py")}
        row = next(line for line in text.splitlines() if re.match(rf"\|[^|]*`{source.name}`[^|]*\|.*\|.*\|$", line))
        assert set(re.findall(r"`(\w+)/`", row)) == rooms, row


def test_every_decision_is_in_the_index():
    index = (ROOT / "docs" / "decisions" / "README.md").read_text(encoding="utf-8")
    records = sorted(path.name for path in (ROOT / "docs" / "decisions").glob("[0-9]*.md"))
    assert re.findall(r"\((\d{4}-[^)]+\.md)\)", index) == records
