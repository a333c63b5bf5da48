import itertools

import pytest
from pybullet_simulator.physics.pacing import Pacer


def run(pacer, steps, work, start=100.0):
    """Returns the times at which the steps start; work(i) is how long step i takes."""
    now, starts = start, []
    for index in range(steps):
        now += pacer.wait(now)
        starts.append(now)
        now += work(index)
    return starts


def test_pace_does_not_drift():
    starts = run(Pacer(0.01), 1001, lambda i: 0.003 + 0.002 * (i % 3))
    assert starts[-1] - starts[0] == pytest.approx(10.0)


def test_small_delay_is_caught_up_without_a_burst():
    starts = run(Pacer(0.01), 200, lambda i: 0.1 if i == 50 else 0.001)
    steps = [b - a for a, b in itertools.pairwise(starts)]
    assert min(steps) >= 0.005 - 1e-9
    assert starts[-1] - starts[0] == pytest.approx(1.99)


def test_long_delay_is_given_up():
    starts = run(Pacer(0.01), 200, lambda i: 3.0 if i == 50 else 0.001)
    assert starts[-1] - starts[0] == pytest.approx(1.99 + 2.99, abs=0.02)


def test_no_pace_never_waits():
    pacer = Pacer(0.0)
    assert [pacer.wait(now) for now in (1.0, 1.1, 5.0)] == [0.0, 0.0, 0.0]
