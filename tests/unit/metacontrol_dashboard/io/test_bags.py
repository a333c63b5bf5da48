"""A recorded run is what the page plays, and other limits tell what would have been done."""

import json

import pytest
from metacontrol_bags.bag_file import BagError
from metacontrol_dashboard.io.bags import read_run, replay
from metacontrol_dashboard.io.page import PageError, page_folder, standalone

START = 100.0


def last_state(recording):
    """Return sections and logs at the end."""
    sections, logs = {}, {}
    for _, change in recording.frames:
        for section, values in change["set"].items():
            sections.setdefault(section, {}).update(values)
        for section, keys in change["drop"].items():
            for key in keys:
                sections.get(section, {}).pop(key, None)
        for log, items in change["add"].items():
            logs.setdefault(log, []).extend(items)
    return sections, logs


def test_run_holds_what_happened_and_what_the_reasoner_knew(bag):
    recording = read_run(bag())
    sections, logs = last_state(recording)
    assert recording.problems == ()
    assert (recording.start, recording.end) == (START, pytest.approx(START + 9.9))
    assert sections["function"]["f_move"]["configuration"] == "camera_slow"
    assert sections["component"]["laser"]["reason"] == "dead"
    [decision] = sections["decision"].values()
    assert (decision["state"], decision["to_configuration"]) == ("EXECUTED", "camera_slow")
    assert sections["design"]["scan_slow"]["blocked_by"] == ["laser"]
    assert sections["objective"]["o_moveA"]["design"] == "camera_slow"
    assert sections["limit"]["safety"]["of"]["o_moveA"] == {"limit": 0.6, "expected": 0.3}
    assert [line["text"] for line in logs["timeline"] if line["step"] == "O"] == ["operator: pause", "operator: resume"]
    assert {item[1] for item in logs["level/safety"]} == {0.28}


def test_state_at_a_moment_is_that_of_the_moment(bag):
    frames = read_run(bag()).frames
    paused = [stamp for stamp, change in frames if change["set"].get("operator", {}).get("state", {}).get("paused")]
    assert paused
    assert all(START + 1.0 <= stamp <= START + 2.6 for stamp in paused)


def test_images_of_a_camera_are_thinned_out(bag):
    images = [(START + i / 10, 2 * i) for i in range(100)]
    frames = [
        (stamp, change["set"]["robot"]["camera"])
        for stamp, change in read_run(bag(images=images)).frames
        if "robot" in change["set"]
    ]
    assert [round(stamp - START) for stamp, _ in frames] == [0, 2, 4, 6, 8]
    assert len({picture for _, picture in frames}) == 5


def test_robot_in_a_namespace_is_found(bag):
    sections, _ = last_state(read_run(bag(space="/crane")))
    assert sections["function"]["f_move"]["configuration"] == "camera_slow"
    assert sections["component"]["laser"]["status"] == "FALSE"


def test_bag_without_a_journal_shows_the_rest(bag):
    recording = read_run(bag(journal=False))
    sections, _ = last_state(recording)
    assert not recording.can_replay
    assert sections["decision"]
    assert "design" not in sections


def test_other_limit_tells_what_it_would_have_done(bag):
    pairs = replay(bag(), {"safety": 0.1})
    assert any(pair["recorded"] and pair["recorded"]["to_configuration"] == "camera_slow" for pair in pairs)
    assert any(
        (pair["replayed"] or {}).get("to_configuration") != (pair["recorded"] or {}).get("to_configuration")
        for pair in pairs
    )


def test_what_is_no_bag_is_refused(tmp_path):
    path = tmp_path / "x.bag"
    path.write_text("no bag")
    with pytest.raises(BagError):
        read_run(path)


def test_exported_page_holds_the_run_and_needs_nothing_else(bag):
    try:
        page_folder()
    except PageError as error:
        pytest.skip(str(error))
    page = standalone(read_run(bag()))
    data = page.partition('id="recording">')[2].partition("</script>")[0]
    assert json.loads(data)["frames"]
    assert 'src="main.js"' not in page
    assert 'href="main.css"' not in page


def test_last_event_of_a_mission_is_in_the_run(bag):
    recording = read_run(bag(ends=3.333))
    told = recording.as_dict()
    assert told["end"] == START + 3.333
    ends = [at for at, change in told["frames"] if "mission" in change.get("set", {})]
    assert ends == [told["end"]]
