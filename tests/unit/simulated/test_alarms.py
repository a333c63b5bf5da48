"""What is told of drivers that are dead or hang, and by when."""

from collections import Counter

import pytest
from metacontrol_msgs.msg import DiagnosticWords as Words
from mros1_reasoner.loop.settings import Settings as LoopSettings
from rosgraph_monitor.evaluation import GraphEvaluator, Patience
from rosgraph_monitor.health.liveness import Timing
from simulated import monitor, systems
from simulated.alarms import DEAD, HUNG, LEAST, STARTUP, Alarms
from simulated.faults import Fault, Kind
from simulated.history import History, run
from simulated.manipulator import Settings as ManipulatorSettings
from simulated.world import World

VALVE = "/valve_driver"
KILLED = Fault(20.0, Kind.KILL_DRIVER, VALVE)
HANGS = Fault(20.0, Kind.FREEZE_NODE, VALVE)


def broken(*faults):
    return "; ".join(run(History(3, "greenhouse", faults)).broken)


def tell(monkeypatch, leave):
    """Have the monitor leave out statuses."""
    real = GraphEvaluator.evaluate

    def evaluate(self, *inputs, **settings):
        return [status for status in real(self, *inputs, **settings) if not leave(status)]

    monkeypatch.setattr(GraphEvaluator, "evaluate", evaluate)


@pytest.fixture
def mute(monkeypatch):
    """Have the monitor say nothing."""
    tell(monkeypatch, lambda status: True)


@pytest.mark.parametrize(("fault", "what"), [(KILLED, "is dead"), (HANGS, "hangs")])
def test_monitor_that_says_nothing_of_a_driver_is_found(fault, what, mute):
    wanted = "Component status of valve, Missing node of valve_driver"
    assert broken(fault) == f"driver {VALVE} {what} since 20.00, and the monitor does not tell: {wanted}"


@pytest.mark.parametrize("words", [Words.COMPONENT_STATUS, Words.MISSING_NODE])
def test_monitor_that_says_half_of_it_is_found(words, monkeypatch):
    tell(monkeypatch, lambda status: status.message == words)
    assert f"does not tell: {words} of valve" in broken(KILLED)


@pytest.mark.parametrize("fault", [KILLED, HANGS])
def test_monitor_that_tells_of_it_is_right(fault):
    assert not broken(fault)


def test_monitor_that_takes_too_long_for_a_node_that_hangs_is_found(monkeypatch):
    monkeypatch.setattr(monitor, "Timing", lambda: Timing(probe_deadline=5.0))
    assert f"{VALVE} hangs" in broken(HANGS)


def test_monitor_that_begins_late_and_takes_too_long_is_found(monkeypatch):
    monkeypatch.setattr(Patience, "grace", lambda self, head_start: 10.0)
    assert f"{VALVE} is dead" in broken(KILLED, Fault(20.0, Kind.KILL_PART, "monitor"))


def due(*faults, until=60.0):
    """When it is found that nobody tells of a driver, and when the last monitor began."""
    world = World(systems.load("greenhouse"), 3, ManipulatorSettings(), LoopSettings(), Counter())
    alarms, found = Alarms(world), []

    def look():
        if not found and list(alarms.missing()):
            found.append(world.kernel.now)

    world.kernel.after_step = look
    for fault in faults:
        world.kernel.at(fault.at, lambda fault=fault: world.strike(fault))
    while not found and world.kernel.now < until:
        world.kernel.run(world.kernel.now + 0.05)
    began = world.monitor.process.started
    world.close()
    return (found or [None])[0], began


def test_driver_that_died_is_told_within_a_second(mute):
    assert due(KILLED)[0] == pytest.approx(20.0 + DEAD, abs=0.1)


def test_driver_that_hangs_is_told_within_five(mute):
    assert due(HANGS)[0] == pytest.approx(20.0 + HUNG, abs=0.1)


def test_driver_that_hung_and_died_is_told_as_one_that_died(mute):
    assert due(HANGS, Fault(22.0, Kind.KILL_DRIVER, VALVE))[0] == pytest.approx(22.0 + DEAD, abs=0.1)


def test_driver_that_goes_on_in_time_need_not_be_told(mute):
    assert due(Fault(20.0, Kind.FREEZE_NODE, VALVE, 4.5))[0] is None


def test_silent_master_and_jumping_clocks_are_no_excuse(mute):
    others = [(Kind.MASTER_SILENT, 5.0), (Kind.CLOCK_STANDS, 9.0), (Kind.CLOCK_JUMPS, -99.0), (Kind.WALL_JUMPS, -99.0)]
    faults = [Fault(19.9, kind, "", value) for kind, value in others]
    assert due(*faults, KILLED)[0] == pytest.approx(20.0 + DEAD, abs=0.1)


def test_monitor_that_hangs_has_its_time_when_it_goes_on(mute):
    assert due(Fault(19.0, Kind.FREEZE_PART, "monitor", 4.0), KILLED)[0] == pytest.approx(23.0 + DEAD, abs=0.1)


def test_monitor_that_begins_late_has_a_short_time_for_drivers_that_it_has_not_seen(mute):
    found, began = due(Fault(19.5, Kind.KILL_PART, "monitor"), KILLED)
    assert began > 19.5 and found == pytest.approx(began + LEAST + DEAD, abs=0.1)


def test_monitor_that_begins_with_the_system_has_longer(mute):
    found, began = due(Fault(0.01, Kind.KILL_DRIVER, VALVE))
    assert STARTUP - 2.0 < found - began <= STARTUP + DEAD + 0.1


def test_monitor_that_hung_tells_at_once_what_died_meanwhile():
    assert not broken(Fault(10.0, Kind.FREEZE_PART, "monitor", 12.0), KILLED)


def test_monitor_that_takes_back_what_it_told_is_found(monkeypatch):
    tell(monkeypatch, lambda status: forgets and status.message == Words.MISSING_NODE)
    world = World(systems.load("greenhouse"), 3, ManipulatorSettings(), LoopSettings(), Counter())
    alarms, forgets = Alarms(world), []
    world.kernel.at(20.0, lambda: world.strike(KILLED))
    world.kernel.run(25.0)
    assert not list(alarms.withdrawn())
    forgets.append(True)
    world.kernel.run(26.0)
    assert f"{VALVE} does not work since 20.00, and is told no more to be missing" in "; ".join(alarms.withdrawn())
    assert not list(alarms.withdrawn())
    world.close()


def test_what_is_told_of_a_driver_that_works_again_may_be_taken_back():
    assert not broken(Fault(20.0, Kind.KILL_DRIVER, VALVE, 3.0))
