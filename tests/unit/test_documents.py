"""Documents of the project: what they link to is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = (".", "docs", "docs/decisions", "docker", "examples", "examples/*", "catkin_ws/src/*")
DOCUMENTS = sorted({path for folder in FOLDERS for path in ROOT.glob(f"{folder}/*.md")})


def anchors(document):
    """Return the anchors that GitHub gives the headings of a document."""
    headings = re.findall(r"^#+ +(.*)$", document.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files_and_headings_that_exist(document):
    dead = []
    for link in re.findall(r"\]\((?!https?:)([^)\s]+)\)", document.read_text(encoding="utf-8")):
        path, _, anchor = link.partition("#")
        target = (document.parent / path).resolve() if path else document
        if not target.exists() or (anchor and anchor not in anchors(target)):
            dead.append(link)
    assert not dead


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
