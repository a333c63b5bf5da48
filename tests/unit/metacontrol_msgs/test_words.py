"""Words that packages without ROS write once more are those of the messages."""

import enum

import pytest
from actionlib_msgs.msg import GoalStatus
from metacontrol_bags import goal_status, words
from metacontrol_msgs import msg
from mros1_reasoner.knowledge import vocabulary

CLASSES = [value for value in vars(words).values() if isinstance(value, type)]


def constants(words_of: type) -> dict[str, object]:
    return {name: value for name, value in vars(words_of).items() if name.isupper()}


@pytest.mark.parametrize("words_of", CLASSES, ids=lambda words_of: words_of.__name__)
def test_words_in_bags_are_those_of_the_messages(words_of):
    message = getattr(msg, words_of.__name__)
    assert constants(words_of)
    assert {name: getattr(message, name) for name in constants(words_of)} == constants(words_of)


def test_states_of_goals_are_those_of_actionlib():
    assert issubclass(goal_status.GoalStatus, enum.Enum)
    assert {state.name: state.value for state in goal_status.GoalStatus} == constants(GoalStatus)


def test_statuses_of_components_in_the_ontology_are_those_on_diagnostics():
    ours = msg.DiagnosticWords
    assert vocabulary.WORKS == ours.COMPONENT_TRUE
    assert vocabulary.FAILED == ours.COMPONENT_FALSE
    assert vocabulary.RECOVERED == ours.COMPONENT_RECOVERED
