"""The command that gives bad inputs, and the processes in which it tries them."""

import contextlib
import os
import signal
import sys
import tracemalloc
from pathlib import Path
from random import Random

import pytest
from bad_input import hostile, soak, trial
from bad_input.messages import changed, pack, serialised, unpack
from bad_input.mutation import LARGEST, changed_tree, mutated
from bad_input.tally import Tally
from bad_input.trial import ACCEPTED, BROKEN, REFUSED, Verdict, made, tried
from std_msgs.msg import Header

GOOD = {
    "yaml": b"a: [1, {b: x}]\nc: null\n",
    "json": b'{"a": [1, {"b": "x"}]}',
    "xml": b'<a b="c"><d/>e</a>',
    "csv": b"name,x\na,1\n",
    "text": b"A { b 'c' }",
    "binary": bytes(range(50)),
}


@pytest.mark.parametrize("kind", GOOD)
def test_inputs_are_the_same_each_time_and_differ_from_each_other(kind):
    made_once, made_again = ([mutated(Random(n), [GOOD[kind]], kind) for n in range(200)] for _ in range(2))
    assert made_once == made_again
    assert len(set(made_once)) > 100
    assert max(map(len, made_once)) <= LARGEST


def test_large_inputs_take_little_to_make():
    tracemalloc.start()
    for n in range(300):
        mutated(Random(n), [bytes(LARGEST)], "binary")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 50 * LARGEST


def test_values_that_are_put_into_trees_are_not_changed_with_them():
    before = repr(hostile.VALUES)
    for n in range(5000):
        changed_tree(Random(n), [[1]])
    assert repr(hostile.VALUES) == before


def test_changed_message_is_one_of_its_type_or_bytes():
    rng, header = Random(1), Header(frame_id="map")
    found = {changed(rng, serialised(header), Header, []) for _ in range(200)}
    assert len(found) > 50


def test_packed_messages_are_unpacked():
    parts = [(0, b""), (2, b"abc")]
    assert unpack(pack(parts)) == parts


def test_input_has_its_number():
    subject, data = made(3, 14)
    again, same = made(3, 14)
    assert (subject.name, data) == (again.name, same)


class Fake:
    """A subject that does what a test wants."""

    name, share = "fake", 1.0

    def __init__(self, run):
        self.run = lambda _data, _folder: run()

    def fault_of(self, refusal):
        return "bad words" if "bad" in refusal else ""


def fails():
    raise KeyError("x")


def hangs():
    while True:
        pass


def catches_all_and_hangs():
    while True:
        with contextlib.suppress(Exception):
            hangs()


def grows():
    bytearray(60_000_000)[::4096] = b"x" * len(range(0, 60_000_000, 4096))


@pytest.mark.parametrize(
    ("run", "outcome", "problem"),
    [
        (lambda: None, ACCEPTED, ""),
        (lambda: "no", REFUSED, ""),
        (lambda: "bad", BROKEN, "bad words"),
        (fails, BROKEN, "KeyError in outside"),
        (sys.exit, BROKEN, "ends the process"),
        (hangs, BROKEN, "HangError in outside"),
        (catches_all_and_hangs, BROKEN, "HangError in outside"),
        (grows, BROKEN, "needs more than 20 MB"),
    ],
)
def test_verdict_tells_what_came_of_an_input(tmp_path, monkeypatch, run, outcome, problem):
    monkeypatch.setattr(trial, "DEADLY", 0.2)
    monkeypatch.setattr(trial, "LARGEST", 20_000_000)
    found = tried(Fake(run), b"", tmp_path)
    assert (found.outcome, found.problem) == (outcome, problem)
    assert list(tmp_path.iterdir()) == []


def worker(code):
    """Return a worker that tells the number of each input, and then does what the code says."""
    program = f"""
import os, sys
for line in sys.stdin:
    for number in range(*map(int, line.split())):
        print(number, flush=True)
        {code}
        print("accepted", "fake", "0.1", "5", "", sep=chr(9), flush=True)
"""
    return lambda seed: soak.Worker(seed, [sys.executable, "-c", program])


def test_input_that_ends_a_worker_is_told_and_the_next_one_is_tried(monkeypatch):
    monkeypatch.setattr(soak, "start_worker", worker("os.abort() if number == 2 else None"))
    found = [(number, verdict.outcome) for number, _, verdict in soak.trials(0, 0, 5)]
    assert found == [(0, ACCEPTED), (1, ACCEPTED), (2, BROKEN), (3, ACCEPTED), (4, ACCEPTED)]


def test_input_that_computes_for_ever_outside_of_python_is_told(monkeypatch):
    code = f"os.kill(os.getpid(), {int(signal.SIGVTALRM)}) if number == 1 else None"
    monkeypatch.setattr(soak, "start_worker", worker(code))
    verdicts = [verdict for _, _, verdict in soak.trials(0, 0, 2)]
    assert verdicts[1].problem.startswith("takes more than")


def test_input_that_waits_for_ever_is_told(monkeypatch):
    monkeypatch.setattr(soak, "_WAITS", 0.2)
    monkeypatch.setattr(soak, "start_worker", worker("import time; time.sleep(1000)"))
    assert [verdict.outcome for _, _, verdict in soak.trials(0, 0, 2)] == [BROKEN, BROKEN]


def run(tmp_path, *arguments):
    return soak.main(["--bad-input", "--output", str(tmp_path), *arguments])


def answers(*outcomes):
    def trials(_seed, first, last):
        for number in range(first, last):
            yield number, "fake", Verdict(outcomes[number], "trouble" if outcomes[number] == BROKEN else "")

    return trials


def state(tmp_path):
    (path,) = tmp_path.glob("*/state.json")
    return Tally.read(path)


def test_second_run_goes_on_where_the_first_one_was(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(soak, "trials", answers(ACCEPTED, REFUSED, REFUSED))
    assert run(tmp_path, "--count", "2") == 0
    assert state(tmp_path).done == 2
    assert run(tmp_path, "--count", "3") == 0
    assert (state(tmp_path).rows["fake"].accepted, state(tmp_path).rows["fake"].refused) == (1, 2)
    assert "| fake | 3 | 1 | 2 | 0 |" in capsys.readouterr().out


def test_interruption_keeps_what_was_done(tmp_path, monkeypatch):
    def trials(*_):
        yield 0, "fake", Verdict(ACCEPTED)
        raise KeyboardInterrupt

    monkeypatch.setattr(soak, "trials", trials)
    assert run(tmp_path, "--count", "5") == 130
    assert state(tmp_path).done == 1


def test_input_that_breaks_something_is_kept_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(soak, "trials", answers(BROKEN, ACCEPTED, BROKEN))
    assert run(tmp_path, "--count", "3") == 1
    (kept,) = (path for path in tmp_path.glob("*/broken/*/*"))
    assert kept.read_bytes() == made(0, 0)[1]
    assert "- fake: trouble: 2 times, first input 0" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--count", "0"], "argument --count: invalid count value: '0'"),
        (["--count", "1", "--seed", "-1"], "argument --seed: invalid seed value: '-1'"),
        ([], "the following arguments are required: --count"),
    ],
)
def test_bad_option_is_refused_in_one_line(tmp_path, capsys, arguments, line):
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, *arguments)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"mros: soak: {line}\n"


def test_state_of_another_form_is_refused_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(soak, "trials", answers(ACCEPTED))
    run(tmp_path, "--count", "1")
    (path,) = tmp_path.glob("*/state.json")
    path.write_text("[]")
    capsys.readouterr()
    with pytest.raises(SystemExit):
        run(tmp_path, "--count", "1")
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "delete it" in error


def test_worker_is_gone_when_the_trials_end(monkeypatch):
    started = []

    def start(seed):
        started.append(worker("pass")(seed))
        return started[-1]

    monkeypatch.setattr(soak, "start_worker", start)
    next(iter(trials := soak.trials(0, 0, 2)))
    trials.close()
    assert not Path(f"/proc/{started[0]._process.pid}").exists() or os.name != "posix"


def test_worker_that_can_not_begin_ends_the_soak_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(soak, "start_worker", lambda seed: soak.Worker(seed, [sys.executable, "-c", ""]))
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, "--count", "3")
    assert ended.value.code == 2
    assert "a worker ends before input 0" in capsys.readouterr().err


def test_trial_leaves_no_timer_on_the_process(tmp_path):
    """The process goes on with other work, such as other tests."""
    subject, data = made(0, 1)
    tried(subject, data, tmp_path)
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0.0, 0.0)
