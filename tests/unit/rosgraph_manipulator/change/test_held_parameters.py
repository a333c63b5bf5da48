"""Parameters of nodes that start are put back until the nodes are up."""

from types import SimpleNamespace

import pytest
from node_kit.io.xml_rpc import SilentError
from rosgraph_manipulator.change.held_parameters import HeldParameters

WANTED = {"/a/inner/x": 4, "/a/x": 1, "/a/y": "s", "/ab/x": 2, "/shared": 3}


class Around:
    """A clock and a parameter server."""

    def __init__(self):
        self.server, self.time, self.cost, self.silent = dict(WANTED), 0.0, 0.0, False
        self.said, self.looks, self.meanwhile = [], 0, lambda: None
        self.log = SimpleNamespace(warn=self.said.append)

    def now(self):
        return self.time

    def parameters(self, names):
        self.looks += 1
        self.time += self.cost
        if self.silent:
            raise SilentError("the master does not answer", "timed out")
        self.meanwhile()
        return {name: self.server[name] for name in names if name in self.server}

    def set_parameters(self, values, delete=()):
        self.server.update(values)


@pytest.fixture
def around():
    return Around()


@pytest.fixture
def up():
    return set()


@pytest.fixture
def held(around, up):
    return HeldParameters("f", WANTED, ["/a", "/ab", "/a/inner"], up.__contains__, around)


def test_what_somebody_changes_or_deletes_is_put_back_and_told(around, held):
    around.server = {"/a/inner/x": 4, "/a/x": "other", "/ab/x": 2.0, "/shared": 3}
    held.look(["/a", "/ab"])
    assert around.server == {**WANTED, "/ab/x": 2.0}  # which is the same value
    assert around.said == ["f: put back, because nodes start: /a/x, /a/y"]


def test_node_that_is_up_may_set_its_own(around, up, held):
    around.server |= {"/a/x": "other", "/ab/x": "other"}
    up.add("/a")
    held.look(["/a", "/ab"])
    assert (around.server["/a/x"], around.server["/ab/x"]) == ("other", 2)


def test_node_that_comes_up_while_it_is_looked_keeps_its_own(around, up, held):
    around.server |= {"/a/x": "other"}
    around.meanwhile = lambda: up.add("/a")
    held.look(["/a"])
    assert around.server["/a/x"] == "other"


def test_what_nodes_share_is_left_alone(around, held):
    around.server["/shared"] = "other"
    held.look(["/a"])
    assert around.server["/shared"] == "other"


def test_looks_take_a_small_part_of_the_time(around, held):
    for _ in range(1000):
        held.look(["/a"])
        around.time += 0.01
    assert 50 < around.looks <= 101
    around.cost, before, begin = 1.0, around.looks, around.time
    while around.time < begin + 100.0:
        held.look(["/a"])
        around.time += 0.01
    assert 5 < around.looks - before <= 11


def test_master_that_is_silent_is_asked_again(around, held):
    around.server["/a/x"] = "other"
    around.silent = True
    held.look(["/a"])
    around.silent, around.time = False, 1.0
    held.look(["/a"])
    assert around.server["/a/x"] == 1


def test_nothing_is_asked_where_no_node_has_parameters_or_all_are_up(around, up, held):
    held.look(["/c"])
    around.time = 1.0
    up.add("/a")
    held.look(["/a"])
    assert around.looks == 0


def test_node_whose_name_is_in_the_namespace_of_another_may_set_its_own(around, up, held):
    around.server |= {"/a/x": "other", "/a/inner/x": "other"}
    up.add("/a/inner")
    held.look(["/a"])
    assert around.server == {**WANTED, "/a/inner/x": "other"}
