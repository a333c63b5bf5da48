"""The commands replay and explain on bags that the tests write."""

import random

import pytest
from bag_helpers import Bag, Life
from click.testing import CliRunner
from mros1_reasoner.cli import replay as replay_module
from mros1_reasoner.cli.explain import explain
from mros1_reasoner.cli.replay import replay
from mros1_reasoner.forward.engine import RuleEngine
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoner_bag import read_decisions, read_recording
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, LevelFact, Lock, SetNfr, Unlock
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.replay.comparison import first_messages
from mros1_reasoner.replay.recording import RecordingError
from reasoner_helpers import HEAD, application

PARAMETERS = {
    "model_file": "/not/here/application.owl",
    "nfr_safety": 0.6,
    "nfr_energy": 0.62,
    "qa_direction": {"performance": "higher_is_better"},
    "correct_expected": False,
}
START = 100.0
NAME = "reasoner-1"
LASER_FAILS = (START + 5.0, ComponentFact("laser", "FALSE", START + 5.0))


class KeptWarm:
    """The tests' reasoner, which a command must not end."""

    def __init__(self, reasoner):
        self.load, self.infer = reasoner.load, reasoner.infer
        self.close = lambda: None


@pytest.fixture(autouse=True)
def warm(pellet, monkeypatch):
    monkeypatch.setattr(
        replay_module, "make_reasoner", lambda name: RuleEngine() if name == "rules" else KeptWarm(pellet)
    )


def levels(quality, level, since, until):
    count = round((until - since) * 10)
    stamps = [START + since + i / 10 for i in range(count)]
    return [(stamp, LevelFact(quality, level, "", stamp)) for stamp in stamps]


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "application.owl"
    path.write_text(application())
    return path


@pytest.fixture
def life(model, pellet):
    """Return a function that has a reasoner live through what is given, and returns it."""

    def live(given=(LASER_FAILS,), until=30.0, **changes):
        parameters = Parameters({**PARAMETERS, **changes})
        knowledge_base = parameters.knowledge_base([model])
        pellet.load(knowledge_base.ontology)
        objectives, settings = parameters.objectives(knowledge_base), parameters.settings(knowledge_base)
        life = Life(Mape(knowledge_base, pellet, objectives, settings, name=NAME))
        life.files = {f"/elsewhere/{path.name}": path.read_text() for path in knowledge_base.files}
        first = (START, ActiveFact("f_move", "scan_slow", "STABLE"))
        life.live(START + until, [first, *given], START)
        return life

    return live


@pytest.fixture
def bag(tmp_path):
    """Return a function that writes what a recorder that came late has of a life."""

    def write(life, joined=0.0, space="", bare=False):
        path = tmp_path / "mission.bag"
        journal, decision = f"{space}/mros1_reasoner/journal", f"{space}/mros1_reasoner/decision"
        if bare:
            journal, decision = journal.lstrip("/"), decision.lstrip("/")
        before = [e for e in life.entries if e.now < START + joined]
        with Bag(path) as bag:
            bag.journal(START + joined, before, 0, NAME, PARAMETERS, life.files, topic=journal)
            for number, item in enumerate(life.entries[len(before) :], len(before)):
                bag.journal(item.now, [item], number, NAME, topic=journal)
            for now, record in life.decisions:
                if now >= START + joined:
                    bag.decision(record, now, decision)
        return path

    return write


def run(command, *arguments):
    result = CliRunner().invoke(command, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    return result


BUSY = [LASER_FAILS, *levels("safety", 0.7, 12.0, 16.0), *levels("energy", 0.9, 22.0, 26.0)]


def test_unchanged_replay_decides_as_recorded(life, bag):
    lived = life(BUSY)
    assert len(first_messages(lived.decisions)) >= 3
    result = run(replay, bag(lived))
    assert result.exit_code == 0, result.output
    assert result.output.count("the same") == len(first_messages(lived.decisions))
    assert "differs" not in result.output


def test_recorder_that_came_late_still_has_all_it_takes(life, bag):
    result = run(replay, bag(life(BUSY), joined=9.0))
    assert result.exit_code == 0, result.output
    assert "the same" in result.output
    assert "differs" not in result.output


def test_bag_brings_the_imported_files_of_a_model_along(tmp_path, life, bag, model, caplog):
    text, ontology = model.read_text(), '<owl:Ontology rdf:about="http://example.org/app"'
    start = text.index('<t:Component rdf:about="#laser">')
    end = text.index("</t:Component>", start) + len("</t:Component>")
    parts = f"{HEAD.replace(ontology, ontology.replace('app', 'other'))}{text[start:end]}</rdf:RDF>"
    (tmp_path / "parts.owl").write_text(parts)
    imports = f'{ontology}><owl:imports rdf:resource="http://example.org/parts"/></owl:Ontology>'
    model.write_text((text[:start] + text[end:]).replace(f"{ontology}/>", imports))
    path = bag(life(BUSY))
    for file in tmp_path.glob("*.owl"):
        file.unlink()
    result = run(replay, path)
    assert result.exit_code == 0, result.output
    assert "camera_slow" in result.output
    assert "going on without" not in caplog.text


def test_other_limit_tells_what_it_would_have_done(life, bag):
    lived = life([LASER_FAILS, *levels("safety", 0.55, 12.0, 18.0)])
    assert len(first_messages(lived.decisions)) == 1
    result = run(replay, bag(lived), "--nfr", "safety=0.5")
    assert result.exit_code == 0
    assert "qa:safety" in result.output
    assert "the replay decides otherwise" in result.output


def test_other_limit_holds_against_what_an_operator_set_then_and_says_so(life, bag):
    set_then = (START + 3.0, SetNfr("", "safety", 0.9))
    path = bag(life([set_then, *levels("safety", 0.55, 12.0, 18.0)]))
    result = run(replay, path, "--nfr", "safety=0.5")
    assert result.exit_code == 0
    assert "qa:safety" in result.output
    assert "set_nfr safety 0.9: the limit is 0.5 now" in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "cool_dwn=1"], "did you mean cool_down?"),
        (["--set", "banana=1"], "nothing reads it"),
        (["--nfr", "saftey=1"], "no quality 'saftey': did you mean safety?"),
    ],
)
def test_name_that_means_nothing_is_refused(life, bag, words, said):
    result = run(replay, bag(life()), *words)
    assert result.exit_code == 2
    assert said in result.output


def test_after_the_parting_requests_are_taken_for_carried_out(life, bag):
    given = [*levels("energy", 0.55, 2.0, 6.0), (START + 15.0, ComponentFact("laser", "FALSE", START + 15.0))]
    lived = life(given)
    (decision,) = [record for _, record in first_messages(lived.decisions)]
    assert decision.from_configuration == "scan_slow"
    result = run(replay, bag(lived), "--nfr", "energy=0.35")
    assert "scan_slow -> scan_slower" in result.output
    assert "scan_slower -> camera_slower" in result.output


def test_other_parameter_that_changes_nothing(life, bag):
    result = run(replay, bag(life()), "--set", "violation_window=3.0")
    assert result.exit_code == 0
    assert "would have decided the same" in result.output
    assert "the same" in result.output.splitlines()[4]


def test_other_choice_at_the_same_moment_stands_beside_the_recorded_one(life, bag):
    result = run(replay, bag(life()), "--nfr", "energy=0.35")
    (row,) = [row for row in result.output.splitlines() if "component:laser" in row]
    assert "scan_slow -> camera_slow " in row
    assert "scan_slow -> camera_slower" in row


def test_what_an_operator_did_is_done_again(life, bag):
    lived = life([(START + 4.0, Lock()), LASER_FAILS, (START + 9.0, Unlock())])
    assert [record.to_configuration for _, record in first_messages(lived.decisions)] == ["", "camera_slow"]
    result = run(replay, bag(lived))
    assert result.exit_code == 0, result.output
    assert result.output.count("the same") == 2


def test_altered_record_is_noticed(life, bag, tmp_path):
    lived = life()
    other = lived.decisions[0]
    lived.decisions[0] = other[0], type(other[1])(**{**other[1].__dict__, "degraded": True})
    result = run(replay, bag(lived))
    assert result.exit_code == 1
    assert "differs: degraded" in result.output


def test_verbose_replay_explains_each_decision(life, bag):
    result = run(replay, bag(life()), "--verbose")
    assert "requires laser, which does not work" in result.output


def test_bag_without_a_journal_is_replayed_from_its_diagnostics(tmp_path, model):
    path = tmp_path / "published.bag"
    with Bag(path) as bag:
        for tick in range(100):
            value = "FALSE" if tick > 50 else "TRUE"
            bag.statuses(START + tick / 10, ("Component status", "laser", 0, (("laser", value),)))
    options = ["--model", model, "--set", "qa_direction={performance: higher_is_better}", "--nfr", "safety=0.6"]
    result = run(replay, path, *options, "--initial", "scan_slow")
    assert result.exit_code == 0, result.output
    assert "scan_slow -> camera_slow" in result.output
    assert "no journal" in result.output
    assert run(replay, path, *options, "--initial", "scan_medium").exit_code == 2


def test_running_configuration_is_taken_from_a_bag_without_a_journal(tmp_path, model):
    path = tmp_path / "other.bag"
    with Bag(path) as bag:
        bag.active(START, "f_move", "scan_slow")
        for tick in range(50):
            bag.statuses(START + tick / 10, ("Component status", "laser", 0, (("laser", "FALSE"),)))
    result = run(replay, path, "--model", model, "--nfr", "energy=0.62")
    assert "scan_slow -> camera_slow" in result.output, result.output


@pytest.mark.parametrize(
    ("publisher", "hardware_id", "adapts"),
    [
        ("/cell_1/rosgraph_monitor", "", True),
        ("/cell_2/rosgraph_monitor", "", False),
        ("/play_42", "robot:/cell_1", True),
        ("/play_42", "robot:/cell_2", False),
    ],
)
def test_replay_heeds_its_own_robot_alone(tmp_path, model, publisher, hardware_id, adapts):
    path = tmp_path / "cells.bag"
    with Bag(path) as bag:
        bag.active(START, "f_move", "scan_slow", space="/cell_1")
        for tick in range(50):
            status = ("Component status", "laser", 0, (("laser", "FALSE"),))
            bag.statuses(START + tick / 10, status, publisher=publisher, hardware_id=hardware_id)
    result = run(replay, path, "--model", model, "--nfr", "energy=0.62")
    assert ("scan_slow -> camera_slow" in result.output) is adapts, result.output


def test_explain_tells_every_decision_of_a_bag(life, bag):
    lived = life(BUSY)
    result = run(explain, bag(lived))
    assert result.exit_code == 0
    for _, record in first_messages(lived.decisions):
        assert record.id in result.output
    assert "EXECUTED" in result.output
    assert "17%" in result.output  # safety 0.7, limit 0.6
    assert "utility 0.1 is less than 0.2" in result.output


@pytest.mark.parametrize("last", [1, 2, 99])
def test_explain_tells_the_last_decisions_if_asked(life, bag, last):
    lived = life(BUSY)
    known = [record.id for _, record in first_messages(lived.decisions)]
    output = run(explain, bag(lived), "--last", last).output
    assert [name for name in known if f" {name}, " in output] == known[-last:]


def test_explain_without_a_master_says_so_in_one_line(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:9")
    result = run(explain, "--last", 2)
    assert result.exit_code == 2
    assert "start roscore" in result.output
    assert result.output.count("\n") == 1


@pytest.mark.parametrize("command", [explain, replay])
def test_what_is_no_bag_is_refused_in_one_line(command, tmp_path):
    path = tmp_path / "no.bag"
    path.write_bytes(b"#ROSBAG V2.0\nnot really")
    for file in (path, tmp_path / "missing.bag"):
        result = run(command, file)
        assert result.exit_code == 2
        assert str(file) in result.output
        assert len(result.output.splitlines()) == 1


def test_missing_part_of_the_journal_is_refused(life, tmp_path):
    lived = life()
    path = tmp_path / "torn.bag"
    with Bag(path) as bag:
        bag.journal(START, lived.entries[:3], 0, NAME, PARAMETERS)
        bag.journal(START + 1, lived.entries[5:6], 5, NAME)
    result = run(replay, path)
    assert result.exit_code == 2
    assert "part of the reasoner's journal is missing" in result.output


def test_beginning_of_the_journal_may_come_after_what_was_published_meanwhile(life, tmp_path):
    lived = life(BUSY)
    path = tmp_path / "crossed.bag"
    with Bag(path) as bag:
        bag.journal(START, lived.entries[5:8], 5, NAME)
        bag.journal(START, lived.entries[:7], 0, NAME, PARAMETERS)
        bag.journal(START + 1, lived.entries[8:], 8, NAME)
    (recorded,) = read_recording(path).runs
    assert (recorded.first, recorded.entries) == (0, list(lived.entries))


@pytest.mark.parametrize(("kind", "values"), [("explode", []), ("level", ["safety"])])
def test_nonsense_in_a_journal_is_refused(tmp_path, model, kind, values):
    path = tmp_path / "strange.bag"
    with Bag(path) as bag:
        strange = bag.types.JournalEntry(now=START, kind=kind, values=values)
        bag.journal(START, [], 0, NAME, PARAMETERS, {"a.owl": model.read_text()}, more=[strange])
    result = run(replay, path)
    assert result.exit_code == 2, result.output
    assert repr(kind) in result.output


def damaged(content, number):
    """Return a bag's bytes with damage: cut off, changed, or with a piece taken out."""
    rng = random.Random(number)
    place, length = rng.randrange(len(content)), rng.randrange(1, 3000)
    match number % 3:
        case 0:
            return content[:place]
        case 1:
            return content[:place] + rng.randbytes(length) + content[place + length :]
        case _:
            return content[:place] + content[place + length :]


def test_damaged_bag_is_read_in_part_or_refused(life, bag, tmp_path):
    content, path = bag(life()).read_bytes(), tmp_path / "damaged.bag"
    ends = set()
    for number in range(150):
        path.write_bytes(damaged(content, number))
        for read in (read_decisions, read_recording):
            try:
                read(path)
                ends.add("read")
            except RecordingError as error:
                ends.add("refused")
                assert str(error).startswith(f"{path}: ")
    assert ends == {"read", "refused"}


def test_bag_that_was_cut_off_tells_the_decisions_that_it_still_holds(life, bag, tmp_path):
    whole = bag(life())
    path = tmp_path / "cut.bag"
    path.write_bytes(whole.read_bytes()[:-200])
    result = run(explain, path)
    assert result.exit_code == 0 and "scan_slow -> camera_slow" in result.stdout
    assert result.stdout == run(explain, whole).stdout


def test_two_reasoners_in_a_bag_need_a_namespace(life, bag):
    path = bag(life(), space="/one")
    assert run(replay, path, "--namespace", "one").exit_code == 0
    with_two = path.with_name("two.bag")
    with Bag(with_two) as two:
        for space in ("one", "two"):
            two.journal(START, [], 0, NAME, PARAMETERS, topic=f"/{space}/mros1_reasoner/journal")
    result = run(replay, with_two)
    assert result.exit_code == 2
    assert "--namespace" in result.output


def test_topics_recorded_without_a_slash_are_found(life, bag):
    lived = life()
    path = bag(lived, bare=True)
    assert [found.id for found in read_decisions(path)] == list(dict.fromkeys(found.id for _, found in lived.decisions))
    assert run(replay, path).exit_code == 0


def test_model_may_be_a_file_of_a_package(life, bag):
    path = bag(life())
    missing = run(replay, path, "--model", "package://mros1_reasoner/owl/nowhere.owl")
    assert (missing.exit_code, "mros1_reasoner/owl/nowhere.owl" in missing.output) == (2, True)
    assert "package://" not in missing.output
