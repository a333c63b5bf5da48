"""The text over a robot, for people."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding
from rosgraph_monitor.diagnostics.status_text import StatusText


def report(message, key, value):
    return DiagnosticArray(status=[DiagnosticStatus(message=message, values=[KeyValue(key, str(value))])])


def test_text_tells_configuration_levels_and_failures():
    text = StatusText()
    assert text.lines() == ()
    text.take_configuration(ActiveConfiguration(functions=[FunctionGrounding("f_navigate", "f2_v2_r2", "STABLE")]))
    text.take_diagnostics(report("QA status", "safety", 0.2))
    text.take_diagnostics(report("QA status", "energy", 0.61))
    assert text.lines() == ("f2_v2_r2", "energy 0.61", "safety 0.20") and not text.alarm
    text.take_limits({"energy": 0.62, "noise": 1.0})
    text.take_diagnostics(report("Component status", "front_laser", "FALSE"))
    text.take_diagnostics(report("QA stale", "safety", "front/scan is silent"))
    text.take_configuration(ActiveConfiguration(functions=[FunctionGrounding("f_navigate", "f1", "RECONFIGURING")]))
    assert (
        text.lines() == ("f1 reconfiguring", "energy 0.61 (limit 0.62)", "safety stale", "front_laser failed")
        and text.alarm
    )
    text.take_diagnostics(report("Component status", "front_laser", "RECOVERED"))
    assert "front_laser failed" not in text.lines()


@pytest.mark.parametrize("value", ["nan", "much", ""])
def test_level_that_is_no_number_is_left_out(value):
    text = StatusText()
    text.take_diagnostics(report("QA status", "safety", value))
    assert text.lines() == ()


def test_functions_are_named_where_there_are_several():
    text = StatusText()
    active = [FunctionGrounding("f_pick", "fd1", "STABLE"), FunctionGrounding("f_move", "fd2", "RECOVERING")]
    text.take_configuration(ActiveConfiguration(functions=[*active, FunctionGrounding("f_see", "", "STABLE")]))
    assert text.lines() == ("f_pick: fd1", "f_move: fd2 recovering") and text.alarm
