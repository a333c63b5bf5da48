"""A quick share of the histories that `./mros soak --simulated` runs for nights."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from metacontrol_msgs.msg import FunctionGrounding
from mros1_reasoner.loop.settings import Settings as LoopSettings
from simulated import systems
from simulated.faults import Fault, Kind
from simulated.history import History, history, run
from simulated.invariants import unfulfilled
from simulated.manipulator import Settings as ManipulatorSettings
from simulated.world import World

TESTS = Path(__file__).parents[2]
SEEDS = range(280)  # a million steps
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


def test_functions_whose_launcher_stays_away_are_told_as_recovering_and_come_back():
    system = systems.load("greenhouse")
    world = World(system, 3, ManipulatorSettings(), LoopSettings(), Counter())

    def told(until):
        world.kernel.run(until)
        return {active.state for active in world.manipulator.told.values()}

    assert told(25.0) == {FunctionGrounding.STABLE}
    world.strike(Fault(25.0, Kind.PAUSE, "", 60.0))  # the reasoner would ask for another configuration
    world.strike(Fault(25.0, Kind.KILL_PART, "launcher", 15.0))
    assert told(26.5) == {FunctionGrounding.STABLE}
    assert told(28.5) == {FunctionGrounding.RECOVERING}
    assert told(39.5) == {FunctionGrounding.RECOVERING}
    assert told(50.0) == {FunctionGrounding.STABLE}
    assert not unfulfilled(world) and not world.broken
    world.close()
