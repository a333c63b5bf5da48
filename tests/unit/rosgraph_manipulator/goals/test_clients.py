"""Who waits for a goal."""

import pytest
from rosgraph_manipulator.goals.clients import Client, client_of

SCRIPT = Client("/cell/script", "http://host:1")
LISTENERS = {"/cell/script", "/record"}


def test_sender_that_listens_is_the_client():
    assert client_of("/cell/script", "http://host:1", LISTENERS, {"/cell/arm"}) == SCRIPT


@pytest.mark.parametrize(("sender", "address"), [("/rostopic_1", "http://host:2"), ("/cell/script", ""), ("", "")])
def test_sender_that_does_not_listen_or_has_gone_is_none(sender, address):
    assert client_of(sender, address, LISTENERS, {"/cell/arm"}) is None


def test_server_that_sends_itself_a_goal_is_no_client_that_can_be_missed():
    assert client_of("/cell/script", "http://host:1", LISTENERS, {"/cell/arm", "/cell/script"}) is None


@pytest.mark.parametrize(
    ("address", "listeners", "refuses", "words"),
    [
        ("http://host:1", LISTENERS, False, ""),
        ("", {"/record"}, False, "its client /cell/script has ended"),
        ("http://host:1", LISTENERS, True, "its client /cell/script has ended"),
        ("http://host:3", LISTENERS, False, "its client /cell/script was started anew"),
        ("http://host:1", {"/record"}, False, "its client /cell/script does not listen to the action any more"),
    ],
)
def test_client_waits_until_it_ends_starts_anew_or_listens_no_more(address, listeners, refuses, words):
    assert SCRIPT.why_gone(address, listeners, refuses) == words


def test_client_that_ends_with_the_server_waits_no_more():
    leaving = {"/cell/arm", "/cell/script"}
    words = "its client /cell/script ends, too"
    assert SCRIPT.why_gone("http://host:1", LISTENERS, refuses=False, leaving=leaving) == words
