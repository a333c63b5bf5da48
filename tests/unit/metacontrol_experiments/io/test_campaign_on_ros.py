"""What a campaign makes of the end of `metacontrol run`."""

import sys

import pytest
from metacontrol_experiments.campaign.progress import Status, is_final
from metacontrol_experiments.io.campaign_on_ros import drive_command

ENDS = """
import pathlib, sys
if {summary}: pathlib.Path({folder!r}, "summary.json").write_text('{{"goal_reached": true}}')
print("metacontrol: the recorder ended before the mission did", file=sys.stderr)
sys.exit({status})
"""


@pytest.fixture
def drive(tmp_path):
    def drive(status, *, summary):
        code = ENDS.format(status=status, folder=str(tmp_path), summary=summary)
        return drive_command([sys.executable, "-c", code], tmp_path, 60.0)

    return drive


def test_mission_whose_bag_is_not_whole_is_driven_again(drive):
    attempt, summary = drive(2, summary=False)
    assert (attempt.status, summary) == (Status.CRASHED, {}) and not is_final([attempt])
    said = "metacontrol run ended with status 2: metacontrol: the recorder ended before the mission did"
    assert attempt.problem == said


@pytest.mark.parametrize("status", [0, 1])
def test_mission_that_was_summarised_is_done(drive, status):
    attempt, summary = drive(status, summary=True)
    assert (attempt.status, summary) == (Status.DONE, {"goal_reached": True}) and is_final([attempt])
