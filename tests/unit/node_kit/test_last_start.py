"""What a node began with, and what of it is set again."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from node_kit.last_start import Kept, json_texts, kept_of, missing, remedy

BY = "/mixer of 7@100"
KEPT = {"/mixer/rate": "10.0", "/mixer/valves": "[1, 2]"}
SETS = r"(?:KeptParameter\(|set_param\(|set_parameters\(\{rospy\.resolve_name\(|\.resolve\()"
SOURCES = Path(__file__).parents[3] / "catkin_ws" / "src"


def starts(present, kept=None, works=lambda values: False, limit=9):
    """Return what there is after each start of a node, until it begins or waits, and whether it has begun."""
    kept = kept or Kept(BY, KEPT)
    seen = []
    while len(seen) < limit:
        present = {**present, **missing(kept, present)}
        if works(present):
            return seen, True
        found = remedy(kept, present, BY)
        for name, value in found.wanted.items():
            present = {key: text for key, text in present.items() if key != name} | ({name: value} if value else {})
        kept = found.kept or kept
        seen.append(present)
        if not found.again:
            return seen, False
    raise AssertionError(f"it never waits: {seen}")


def test_what_is_missing_is_set_again_before_all_else():
    assert missing(Kept(BY, KEPT), {"/mixer/rate": "3.0"}) == {"/mixer/valves": "[1, 2]"}
    assert missing(Kept(BY, None), {}) == missing(None, {}) == {}


@pytest.mark.parametrize(
    "changed",
    [
        {**KEPT, "/mixer/rate": '"fast"'},
        {**KEPT, "/mixer/valve": "7"},
        {**KEPT, **json_texts({"/mixer/since": {1, 2}})},  # no JSON
        {"/mixer/rate": "3.0"},
    ],
)
def test_what_has_changed_is_set_again_where_it_can_not_begin(changed):
    assert starts(changed, works=lambda values: values == KEPT) == ([KEPT], True)


def test_change_with_which_it_can_begin_holds():
    assert starts({**KEPT, "/mixer/rate": "3.0"}, works=lambda values: True) == ([], True)


def test_changes_are_put_back_where_something_else_is_wrong():
    wanted = {"/mixer/rate": "2.0", "/mixer/valves": "[1, 2]", "/mixer/patience": "7"}
    seen, begun = starts(wanted)
    assert (seen, begun) == ([KEPT, wanted], False)
    kept = Kept(BY, KEPT, wanted, (), in_vain=True)
    assert starts(wanted, kept) == ([wanted], False)  # the next one waits at once
    other = {**wanted, "/mixer/rate": "1.0"}
    assert starts(other, kept) == ([KEPT, other], False)


def test_setting_that_has_no_effect_is_not_tried_for_ever():
    bad = {**KEPT, "/mixer/rate": '"fast"'}
    first = remedy(Kept(BY, KEPT), bad, BY)
    assert first.again
    second = remedy(first.kept, bad, BY)  # the master has it as before
    assert not second.again and second.wanted == {}


def test_unchanged_parameters_leave_it_waiting():
    assert starts(KEPT) == ([KEPT], False)


def test_process_of_another_roslaunch_takes_over_what_is_kept():
    found = remedy(None, KEPT, BY)
    assert (found.wanted, found.again, found.kept) == ({}, False, Kept(BY, None))
    assert remedy(found.kept, {**KEPT, "/mixer/rate": "3.0"}, BY).wanted == {}


@pytest.mark.parametrize("by", ["/mixer of 7@200", "/mixer__a of 7@100", ""])
def test_only_the_same_node_of_the_same_supervisor_goes_on_with_it(by):
    kept = Kept(BY, KEPT, {"/mixer/rate": '"x"'}, ("/mixer/rate",))
    assert kept_of(kept.to_text(), BY) == kept
    assert kept_of(kept.to_text(), by) is None


GOOD = json.loads(Kept(BY, KEPT).to_text())


@pytest.mark.parametrize(
    "text",
    [
        *(None, 3, "", "{", "[]", "{}", "[" * 100_000),
        *(json.dumps({**GOOD, "values": values}) for values in (0, [], {"/a": "{"}, {"/a": 5}, {"a": "5"})),
        *(json.dumps({**GOOD, "found": values}) for values in ("", {"/a": "{"})),
        *(json.dumps({**GOOD, "names": values}) for values in (5, [5])),
    ],
)
def test_what_somebody_has_garbled_counts_as_nothing(text):
    assert kept_of(text, BY) is None
    assert kept_of(replace(Kept(BY, KEPT)).to_text(), BY)


@pytest.mark.parametrize(
    ("package", "run"),
    [
        ("rosgraph_manipulator", "manipulator.py"),
        ("rosgraph_launcher", "launcher.py"),
        ("rosgraph_monitor", "monitor.py"),
        ("mros1_reasoner", "run.py"),
    ],
)
def test_each_part_names_the_private_parameters_that_it_sets(package, run):
    folder = SOURCES / package / "src" / package
    text = "".join(path.read_text() for path in folder.rglob("*.py"))
    found = re.findall(rf"{SETS}\"~(\w+)\"|f\"~(\w+)/", text)
    told = re.search(r"writes=\(([^)]*)\)", (folder / "ros" / run).read_text())
    assert {one or other for one, other in found} == set(re.findall(r'"(\w+)"', told[1]) if told else ())
