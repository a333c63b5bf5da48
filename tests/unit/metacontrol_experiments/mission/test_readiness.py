"""What a mission waits for before it sends its goal."""

from metacontrol_bags.record import ConfigurationReport
from metacontrol_experiments.mission.readiness import Readiness


def missing(readiness):
    return [
        what
        for condition, what in readiness.conditions(["safety"], "the action server of move_base")
        if not condition()
    ]


def test_everything_is_missing_at_first():
    assert missing(Readiness()) == [
        "a STABLE configuration on rosgraph_manipulator/active_configuration",
        "the action server of move_base",
        "the monitor's first look at the graph, on /diagnostics",
        "a level of safety on /diagnostics, from its observer",
    ]


def test_nothing_is_missing_once_all_was_heard():
    readiness = Readiness(has_server=True, has_graph=True, observed={"safety", "energy"})
    readiness.take_configurations([ConfigurationReport(1.0, "f_navigate", "a", "STABLE")])
    assert missing(readiness) == []


def test_one_function_under_reconfiguration_is_not_stable():
    readiness = Readiness()
    readiness.take_configurations([])
    assert not readiness.stable
    states = (("f_navigate", "STABLE"), ("f_carry", "RECONFIGURING"))
    readiness.take_configurations(ConfigurationReport(1.0, function, "a", state) for function, state in states)
    assert not readiness.stable and readiness.failed is None


def test_failed_configuration_is_named():
    readiness = Readiness()
    readiness.take_configurations([ConfigurationReport(1.0, "f_navigate", "a", "FAILED")])
    assert readiness.failed == "the manipulator could not deploy a"
