"""A quick share of the soak, and all inputs that once broke something."""

import logging
from pathlib import Path

import pytest
from bad_input import unconnected
from bad_input.listeners import LISTENERS, packed, take
from bad_input.soak import trials
from bad_input.subjects import CORPUS, slug, subjects
from bad_input.trial import ACCEPTED, BROKEN, tried
from mros1_reasoner.io import ontology_files

KEPT = sorted(path for path in CORPUS.glob("*/*"))
COUNT = 2000


def test_nothing_breaks_by_a_share_of_bad_inputs():
    broken = [
        f"input {number}: {subject}: {verdict.problem}"
        for number, subject, verdict in trials(0, 0, COUNT)
        if verdict.outcome == BROKEN
    ]
    assert broken == []


@pytest.mark.parametrize("path", KEPT, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_input_that_once_broke_something_does_so_no_more(path: Path, tmp_path: Path):
    (subject,) = (subject for subject in subjects() if slug(subject.name) == path.parent.name)
    verdict = tried(subject, path.read_bytes(), tmp_path)
    assert verdict.outcome != BROKEN, verdict.detail


@pytest.mark.parametrize("subject", subjects(), ids=lambda subject: subject.name)
def test_some_seed_of_each_is_taken(subject, tmp_path: Path):
    verdicts = [tried(subject, seed, tmp_path) for seed in subject.seeds]
    assert BROKEN not in {verdict.outcome for verdict in verdicts}
    warns = subject.name == "the reasoner"  # of a quality that is stale
    assert warns or ACCEPTED in {verdict.outcome for verdict in verdicts}


def test_good_messages_have_move_base_drive(monkeypatch):
    """Else bad ones would not come as far as its costmaps, planner and controller."""
    speeds = []
    monkeypatch.setattr(
        unconnected.Publisher,
        "publish",
        lambda self, *said, **_: speeds.append(said[0].linear.x) if self.name == "/cmd_vel" else None,
    )
    (listener,) = (one for one in LISTENERS if one.name == "move_base")
    take(listener, packed(listener, listener.seeds()))
    assert max(speeds) > 0.1


def test_trial_leaves_what_others_read_as_it_was(tmp_path: Path):
    log, read = logging.getLogger("mros1_reasoner"), ontology_files.read_triples
    level = log.level
    (subject,) = (subject for subject in subjects() if subject.name == "an ontology")
    tried(subject, subject.seeds[0], tmp_path)
    assert (log.level, ontology_files.read_triples) == (level, read)
