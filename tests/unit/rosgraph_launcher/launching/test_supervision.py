"""The supervision of nodes, over processes and names that are played."""

import pytest
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.contested import ANSWER_TIMEOUT
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.restarts import RestartPolicy
from rosgraph_launcher.launching.supervision import Supervisor


class World:
    """Commands, processes, names and the clock.

    Attributes:
        now: s.
        running: the nodes that have a process.
        ended: exit status of those that have ended by themselves, and are not taken yet.
        offers: what nodes advertise, by name.
        takers: who has the name of a node.
    """

    def __init__(self):
        self.now, self.running, self.ended = 100.0, set(), {}
        self.offers, self.takers = {}, {}

    def command(self, node):
        return node

    def take_ended(self):
        ended, self.ended = self.ended, {}
        self.running -= ended.keys()
        return ended

    def prepare(self, command):
        return None

    def begin(self, name, command, prepared):
        self.running.add(name)
        return self.now

    def begin_again(self, name, command):
        return self.begin(name, command, None)

    def ask_to_end(self, names):
        """Nobody is in a hurry."""

    def end(self, names, forget=(), patience=True):
        self.running.difference_update(names)

    def stand_by(self, names, may_start):
        return False

    def successor(self, name):
        return self.takers.get(name, "")

    def is_own(self, name, conflict):
        return False

    def advertised(self, name):
        return self.offers.get(name, set())


@pytest.fixture
def world():
    return World()


@pytest.fixture
def reports():
    return {}


@pytest.fixture
def supervise(world, reports):
    """Start nodes for the function f; return who looks after them."""

    def begin(*names, **policy):
        def note(told):
            reports.update({report.function: report for report in told})

        options = LauncherOptions("mark", policy=RestartPolicy(**policy))
        supervisor = Supervisor(options, note, lambda line: None, world, world, world, lambda: world.now)
        supervisor.change("f", "c", {name: NodeDescription(name, "/", "p", "x") for name in names}, (), names)
        return supervisor

    return begin


@pytest.mark.parametrize("intensity", [0, 3])
def test_nodes_that_hang_under_contested_names_are_given_up_together(world, reports, supervise, intensity):
    world.takers = {"/driver": "its name is taken", "/filter": "its name is taken"}
    supervisor = supervise(*world.takers, intensity=intensity)
    for _ in range(10 * (intensity + 1)):
        world.now += ANSWER_TIMEOUT / 5
        supervisor.look_after()
    assert reports["f"].state == "FAILED"
    assert not world.running


def test_node_that_advertised_after_the_last_look_has_not_done_its_work(world, reports, supervise):
    supervisor = supervise("/detector")
    for world.now in (101.0, 102.0, 104.0):
        supervisor.look_after()
    world.offers["/detector"] = {"/detections"}  # which the master still has, because it ended without a word
    world.ended["/detector"], world.now = 0, 105.0
    supervisor.look_after()
    assert (reports["f"].state, reports["f"].dead) == ("RECOVERING", ("/detector",))


def test_node_that_has_never_advertised_anything_may_end(world, reports, supervise):
    supervisor = supervise("/tool")
    world.ended["/tool"], world.now = 0, 105.0
    supervisor.look_after()
    assert (reports["f"].state, reports["f"].nodes) == ("STABLE", ())
