"""Requests that come by the two actions."""

from types import SimpleNamespace

import pytest
from node_kit.io.inbox import Inbox
from rosgraph_manipulator.change.deployment import Outcome, Result
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.ros import requests
from rosgraph_manipulator.ros.requests import RequestServer

A = Configuration("a", "f", "a.launch")


class Goal:
    """A goal with the id that each client gives to its own."""

    def __init__(self, **asked):
        self.told, self._asked = [], SimpleNamespace(**asked)

    def get_goal(self):
        return self._asked

    def get_goal_id(self):
        return SimpleNamespace(id="7")

    def __getattr__(self, name):
        return lambda *_: self.told.append(name)


@pytest.fixture
def served(monkeypatch):
    """The callbacks of each action, and the inbox in which orders wait."""
    actions = []
    monkeypatch.setattr(requests, "ActionServer", lambda _name, _kind, *callbacks, **_: actions.append(callbacks))
    inbox = Inbox()
    options = ManipulatorOptions({"a": A})
    RequestServer(options, Policy.WAIT, inbox, lambda _order: Outcome(Result.OK, A, ""), lambda _function: None)
    return actions, inbox


@pytest.fixture
def goals():
    return [Goal(desired_configuration_name="a"), Goal(function="f", configuration="a", restart=())]


def work_off(inbox):
    while inbox:
        inbox.do_next()


def test_goals_of_two_actions_may_have_the_same_id(served, goals):
    actions, inbox = served
    for (on_goal, _), goal in zip(actions, goals, strict=True):
        on_goal(goal)
    work_off(inbox)
    assert [goal.told for goal in goals] == [["set_accepted", "set_succeeded"]] * 2


def test_goal_of_the_same_id_at_the_other_action_is_not_taken_back(served, goals):
    actions, inbox = served
    for (on_goal, _), goal in zip(actions, goals, strict=True):
        on_goal(goal)
    actions[1][1](goals[1])
    work_off(inbox)
    assert [goal.told[-1] for goal in goals] == ["set_succeeded", "set_canceled"]
