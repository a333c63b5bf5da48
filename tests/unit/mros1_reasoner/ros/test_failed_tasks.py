"""What a reasoner takes in of the goals of ~task_actions."""

from types import SimpleNamespace

import pytest
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.entries import TaskFact
from mros1_reasoner.ros.reasoner import ReasonerNode

ABORTED = "a goal of /build was aborted"


class Reasoner:
    """In place of a node: one objective is asked for."""

    def __init__(self):
        self.core = SimpleNamespace(objectives={"o_look": Objective("o_look", "f_look")})
        self._log = SimpleNamespace(warn=lambda _, text: self.told.append(text))
        self.taken, self.told = [], []
        self._take = self.taken.append


@pytest.mark.parametrize("name", ["o_look", "f_look"])
def test_failed_task_of_an_objective_is_taken_in(name):
    node = Reasoner()
    ReasonerNode._take_task(node, name, "/build", True)
    assert node.taken == [TaskFact(name, True, message=ABORTED)]


def test_failed_task_of_an_objective_that_is_gone_is_no_other_ones():
    node = Reasoner()
    ReasonerNode._take_task(node, "o_build", "/build", False)
    assert not node.told
    ReasonerNode._take_task(node, "o_build", "/build", True)
    assert not node.taken
    assert node.told == [f"{ABORTED}, but o_build is not asked for: left out"]
