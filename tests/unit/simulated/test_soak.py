"""The command that runs histories for hours."""

import pytest
from simulated import soak
from simulated.tally import Tally, quantile

SHORT = "0.0002"


def run(tmp_path, *arguments):
    return soak.main(["--simulated", "--output", str(tmp_path), *arguments])


def state(tmp_path):
    (path,) = tmp_path.glob("*/state.json")
    return Tally.read(path)


def test_second_run_goes_on_where_the_first_one_was(tmp_path, capsys):
    assert run(tmp_path, "--hours", SHORT, "--seed", "7") == 0
    first = state(tmp_path)
    assert run(tmp_path, "--hours", "0.0004", "--seed", "7") == 0
    second = state(tmp_path)
    assert (second.first_seed, first.first_seed) == (7, 7)
    assert second.histories > first.histories > 0 and second.steps > first.steps
    assert f"{second.histories:,} histories (seeds 7 to {second.next_seed - 1})" in capsys.readouterr().out


def test_interruption_keeps_what_was_done(tmp_path, monkeypatch):
    real, count = soak.run, iter(range(100))

    def interrupted(told):
        if next(count) == 3:
            raise KeyboardInterrupt
        return real(told)

    monkeypatch.setattr(soak, "run", interrupted)
    assert run(tmp_path, "--hours", "1") == 130
    assert state(tmp_path).histories == 3


def test_history_that_fails_is_shrunk_and_kept(tmp_path, monkeypatch):
    real = soak.run

    def fails(told):
        outcome = real(told)
        outcome.broken = ["all is lost"]
        return outcome

    monkeypatch.setattr(soak, "run", fails)
    monkeypatch.setattr(soak, "shrink", lambda told: told)
    assert run(tmp_path, "--hours", "0.000001") == 1
    (text,) = (path.read_text() for path in tmp_path.glob("*/failed-0.py"))
    assert "# all is lost" in text


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--hours", "-1"], "argument --hours: invalid number of hours value: '-1'"),
        (["--hours", "1", "--seed", "x"], "argument --seed: invalid seed value: 'x'"),
        ([], "the following arguments are required: --hours"),
    ],
)
def test_bad_option_is_refused_in_one_line(tmp_path, capsys, arguments, line):
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, *arguments)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"mros: soak: {line}\n"


def test_state_of_another_form_is_refused_in_one_line(tmp_path, capsys):
    run(tmp_path, "--hours", "0.000001")
    (path,) = tmp_path.glob("*/state.json")
    path.write_text("[]")
    capsys.readouterr()
    with pytest.raises(SystemExit):
        run(tmp_path, "--hours", "1")
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "delete it" in error


def test_quantiles_are_times_that_were_seen():
    times = {"0.5": 90, "10.0": 9, "60.0": 1}
    assert [quantile(times, share) for share in (0.5, 0.95, 1.0)] == [0.5, 10.0, 60.0]
