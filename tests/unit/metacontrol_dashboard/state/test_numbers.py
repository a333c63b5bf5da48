"""Numbers that JSON does not have: a page can read all that it gets."""

import json
import math
import threading

import pytest
from metacontrol_bags import messages
from metacontrol_dashboard.io.server import Viewers, _dumps
from metacontrol_dashboard.state.feed import Feed
from metacontrol_dashboard.state.numbers import finite
from metacontrol_dashboard.state.recording import Recorder, Recording
from metacontrol_dashboard.state.store import Store
from metacontrol_msgs.msg import ActiveConfiguration, Candidate, Cause, Decision, ExpectedQA, FunctionGrounding, Phase

BAD = (math.nan, math.inf, -math.inf)


def floats_of(message):
    return [name for name, kind in zip(message.__slots__, message._slot_types, strict=True) if kind == "float64"]


def decision_with(part, name, value):
    """A decision in which this float of one of its parts is bad."""
    parts = {kind: kind() for kind in (Decision, Cause, Candidate, ExpectedQA)}
    setattr(parts[part], name, value)
    made = parts[Decision]
    made.id, made.state = "a", "DECIDED"
    parts[ExpectedQA].name = "noise"
    parts[Candidate].expected_qas = parts[Candidate].levels = [parts[ExpectedQA]]
    made.reasons, made.candidates = [parts[Cause]], [parts[Candidate]]
    return made


def strict(text):
    """What a page reads."""

    def refuse(name):
        raise ValueError(f"JSON has no {name}")

    return json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize(
    ("part", "name"), [(part, name) for part in (Decision, Cause, Candidate, ExpectedQA) for name in floats_of(part())]
)
def test_decision_with_a_number_that_json_lacks_can_be_read(part, name, value):
    store = Store()
    Feed(store).take_decision(messages.decision(decision_with(part, name, value), 1.0))
    _, text = Viewers(store, threading.Lock())._news(0)
    told = strict(text)["set"]["decision"]["a"]
    assert "null" in json.dumps(told) and told["state"] == "DECIDED"


@pytest.mark.parametrize("value", BAD)
def test_configuration_with_a_number_that_json_lacks_can_be_read(value):
    store = Store()
    functions = [FunctionGrounding(function="f_sail", configuration="slow", state="STABLE")]
    message = ActiveConfiguration(functions=functions, phases=[Phase(name="start", duration=value)])
    Feed(store).take_configuration(message, 1.0)
    _, text = Viewers(store, threading.Lock())._news(0)
    assert strict(text)["set"]["change"]["last"]["phases"] == [{"name": "start", "duration": None}]


def test_same_bad_number_is_no_change():
    store = Store()
    assert store.set("usage", "/sonar", {"cpu": math.nan})
    assert not store.set("usage", "/sonar", {"cpu": math.nan})


def test_log_and_recording_have_no_number_that_json_lacks():
    store = Store()
    recorder = Recorder(store)
    store.append("level/noise", [1.0, math.nan])
    recorder.cut(1.0)
    recording = Recording("run", 0.0, 1.0, tuple(recorder.frames))
    assert "[1.0, null]" in json.dumps(recording.as_dict(), allow_nan=False)


def test_answer_to_an_operator_can_be_read():
    assert strict(_dumps({"ok": True, "after": math.nan, "pairs": [(1, math.inf)]})) == {
        "ok": True,
        "after": None,
        "pairs": [[1, None]],
    }


def test_all_else_stays_as_it_is():
    value = {"a": [1, 2.5, "x", None, True], "b": (1.0, {"c": "nan"})}
    assert finite(value) == value
