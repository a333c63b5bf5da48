"""Each promise of docs/security.md has tests that are there."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
TEXT = (TESTS.parent / "docs" / "security.md").read_text()


def promises(text):
    """The rows of the table of promises, each as what is promised and what stands for its tests."""
    (section,) = re.findall(r"^## What is promised\n(.+?)^## ", text, re.MULTILINE | re.DOTALL)
    header, _, *rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    assert [cell.strip() for cell in header] == ["promise", "how", "tests"]
    return [(row[0].strip(), row[-1]) for row in rows]


def missing(tests):
    """What a promise lacks: tests that it names and that are not there, or any at all."""
    named = re.findall(r"`([^`]+)::([^`]+)`", tests)
    return [f"{file}::{name}" for file, name in named if not is_there(TESTS / file, name)] if named else ["a test"]


def is_there(path, name):
    return path.is_file() and bool(re.search(rf"^ *def {re.escape(name)}\(", path.read_text(), re.MULTILINE))


def test_all_promises_are_found():
    assert len(promises(TEXT)) > 15
    assert len(promises(TEXT)) == len(re.findall(r"^\| .+::.+ \|$", TEXT, re.MULTILINE))


@pytest.mark.parametrize(("promise", "tests"), [pytest.param(*row, id=row[0]) for row in promises(TEXT)])
def test_each_promise_has_tests_that_are_there(promise, tests):
    assert missing(tests) == [], promise


@pytest.mark.parametrize(
    ("tests", "lacks"),
    [
        (" ", ["a test"]),
        (" lint ", ["a test"]),
        (" `unit/test_security_document.py::test_nothing` ", ["unit/test_security_document.py::test_nothing"]),
        (" `unit/gone.py::test_all_promises_are_found` ", ["unit/gone.py::test_all_promises_are_found"]),
        (" lint; `unit/test_security_document.py::test_all_promises_are_found` ", []),
    ],
)
def test_promise_without_a_test_that_is_there_is_found(tests, lacks):
    row = f"| Nothing is lost | all is kept |{tests}|"
    table = f"## What is promised\n\n| promise | how | tests |\n|---|---|---|\n{row}\n\n## What is left\n"
    assert [missing(named) for _, named in promises(table)] == [lacks]
