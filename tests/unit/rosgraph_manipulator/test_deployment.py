"""Deploying a configuration, and coming back when it fails."""

import pytest
from rosgraph_manipulator.configuration import Configuration
from rosgraph_manipulator.deployment import DeploymentError, Result, deploy

GOOD = Configuration("good", "f", "good.launch")
BAD = Configuration("bad", "f", "bad.launch")
WORSE = Configuration("worse", "f", "worse.launch")


class Recorder:
    """A platform on which some configurations do not come up."""

    def __init__(self, broken=(), stop_fails=False):
        self.calls = []
        self._broken = broken
        self._stop_fails = stop_fails

    def stop(self):
        self.calls.append("stop")
        if self._stop_fails:
            raise DeploymentError("a node does not end")

    def start(self, configuration):
        self.calls.append(configuration.name)
        if configuration in self._broken:
            raise DeploymentError("does not come up")


def test_wanted_configuration_replaces_the_running_one():
    platform = Recorder()
    outcome = deploy(platform, GOOD, BAD)
    assert (outcome.result, outcome.running) == (Result.OK, GOOD)
    assert platform.calls == ["stop", "good"]


def test_last_good_configuration_is_restored_when_the_wanted_one_fails():
    platform = Recorder(broken=[BAD])
    outcome = deploy(platform, BAD, GOOD)
    assert (outcome.result, outcome.running) == (Result.FAILED, GOOD)
    assert platform.calls == ["stop", "bad", "stop", "good"]
    assert "does not come up" in outcome.message


@pytest.mark.parametrize("last_good", [None, WORSE])
def test_nothing_runs_when_there_is_nothing_to_restore(last_good):
    outcome = deploy(Recorder(broken=[BAD, WORSE]), BAD, last_good)
    assert (outcome.result, outcome.running) == (Result.GENERAL_ERROR, None)


def test_nothing_is_started_beside_nodes_that_do_not_end():
    platform = Recorder(stop_fails=True)
    outcome = deploy(platform, GOOD, BAD)
    assert outcome.result is Result.GENERAL_ERROR
    assert platform.calls == ["stop", "stop"]
