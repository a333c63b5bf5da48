"""What a node began with, and what of it is set again."""

import json

import pytest
from node_kit.last_start import kept_of, to_restore

KEPT = {"/mixer/rate": "10.0", "/mixer/valves": "[1, 2]"}


@pytest.mark.parametrize(
    ("present", "names"),
    [
        (KEPT, []),
        ({"/mixer/rate": "10.0"}, ["/mixer/valves"]),
        ({"/mixer/rate": "3.0"}, ["/mixer/valves"]),  # what was set is another matter, as long as one is missing
        ({**KEPT, "/mixer/rate": '"fast"'}, ["/mixer/rate"]),
        ({**KEPT, "/mixer/valve": "7"}, ["/mixer/valve"]),
        ({}, ["/mixer/rate", "/mixer/valves"]),
    ],
)
def test_what_is_missing_is_set_again_and_else_what_has_changed(present, names):
    assert to_restore(KEPT, present) == names


@pytest.mark.parametrize(("supervisor", "kept"), [("7@100", KEPT), ("7@200", None), ("", None)])
def test_only_what_the_same_supervisor_has_started_goes_on_with_it(supervisor, kept):
    assert kept_of(json.dumps(["7@100", KEPT]), supervisor) == kept


@pytest.mark.parametrize(
    "text", [None, 3, "", "{", "[]", '["7@100", 5]', '["7@100", {"/a": "{"}]', '["7@100", {"/a": 5}]', "[" * 100_000]
)
def test_what_somebody_has_garbled_counts_as_nothing(text):
    assert kept_of(text, "7@100") is None
