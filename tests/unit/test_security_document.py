"""Each promise of docs/security.md has tests that are there."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
ROWS = re.findall(r"^\| .+ \|$", (TESTS.parent / "docs" / "security.md").read_text(), re.MULTILINE)
PROMISES = [row for row in ROWS if "::" in row]


def test_each_promise_has_tests_that_are_there():
    assert len(PROMISES) > 10
    for row in PROMISES:
        named = re.findall(r"`([\w/]+\.py)::(\w+)`", row)
        assert named, row
        for file, name in named:
            assert re.search(rf"^ *def {name}\(", (TESTS / file).read_text(), re.MULTILINE), f"{file}::{name}"
