"""Observers by name."""

import pytest
from rosgraph_monitor.observers.energy import EnergyQualityObserver
from rosgraph_monitor.observers.plugins import PluginError, available, make


def test_exported_observers_are_found():
    assert available()["EnergyQualityObserver"] == "rosgraph_monitor.observers.energy:EnergyQualityObserver"


def test_observer_by_name_and_by_class():
    assert isinstance(make("EnergyQualityObserver"), EnergyQualityObserver)
    assert isinstance(make("rosgraph_monitor.observers.energy:EnergyQualityObserver"), EnergyQualityObserver)


@pytest.mark.parametrize("name", ["Nobody", "os:system", "no.such.module:X", "rosgraph_monitor.observer:X", "../x:Y"])
def test_what_is_no_observer_is_refused(name):
    with pytest.raises(PluginError, match="observer"):
        make(name)
