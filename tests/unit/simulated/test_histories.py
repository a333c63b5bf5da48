"""A quick share of the histories that `./mros soak --simulated` runs for nights."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from metacontrol_msgs.msg import FunctionGrounding
from simulated import systems
from simulated.faults import Fault, Kind
from simulated.history import History, history, run

TESTS = Path(__file__).parents[2]
SEEDS = range(120)
DIGESTS = "from simulated.history import history, run; print([run(history(seed)).digest for seed in range(12)])"


@pytest.mark.parametrize("eighth", range(8))
def test_nothing_is_broken_and_all_recovers(eighth):
    broken = {seed: outcome.broken[0] for seed in SEEDS[eighth::8] if (outcome := run(history(seed))).broken}
    assert not broken


def test_seed_gives_one_history_whatever_the_order_of_sets():
    digests = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": f"{TESTS}:{os.environ['PYTHONPATH']}"}
        digests.add(
            subprocess.run([sys.executable, "-c", DIGESTS], env=environment, capture_output=True, check=True).stdout
        )
    assert len(digests) == 1


@pytest.mark.parametrize("name", systems.NAMES)
def test_system_without_faults_is_deployed(name):
    outcome = run(History(1, name, ()))
    assert not outcome.broken and outcome.recovery is not None


def deployed(faults, system="greenhouse"):
    """What is told at the end of a history."""
    outcome = run(History(3, system, faults))
    assert not outcome.broken
    return {told.function: (told.configuration, told.state) for told in outcome.told}


def test_system_adapts_to_a_driver_that_is_dead_for_good():
    before = deployed(())
    after = deployed((Fault(20.0, Kind.KILL_DRIVER, "/valve_driver"),))
    assert before == {"f_water": ("drip", FunctionGrounding.STABLE)}
    assert after == {"f_water": ("sprinkle", FunctionGrounding.STABLE)}
