"""The yardstick: energies of traces for any constants of the vibration, and the constants that fit."""

from dataclasses import replace

import numpy as np
import pytest
from metacontrol_experiments.campaign.definition import QUANTILES
from metacontrol_experiments.campaign.yardstick import SAMPLES, Trace, Vibration, fit, levels, loss, targets
from robot_formulas.power import energy_level, power_load

STILL = Vibration(0.0, 1e9, 0.0)
LIMITS = {"safety": 0.6, "energy": 0.62}


def a_trace(variant="f2_v2_r1", speed=0.5, seconds=40, **changes):
    """A mission at a steady speed, whose risk passes its threshold for a twentieth of the time."""
    rows = np.full((seconds, SAMPLES), speed)
    risk = np.where(np.arange(seconds * 10) % 20 == 0, 0.7, 0.2)
    share = np.linspace(0.0, 1.0, seconds)
    usual = Trace(
        variant, "r1", 1, 0, True, float(seconds), risk, 0.0 * rows, rows, rows[:, 0], rows[:, 0] * 0.0 + 20.0, share
    )
    return replace(usual, **changes)


def test_without_vibration_the_level_is_that_of_the_power_model():
    trace = a_trace(acceleration=np.full((40, SAMPLES), 3.0))
    assert levels(trace, STILL, 1.0) == pytest.approx(energy_level(power_load(0.5, 3.0, 20.0)))


def test_a_power_contingency_strikes_after_its_share_of_the_way():
    found = levels(a_trace(), STILL, 1.6)[0]
    assert found[:24] == pytest.approx(energy_level(power_load(0.5, 0.0, 20.0)))
    assert found[24:] == pytest.approx(energy_level(power_load(0.5, 0.0, 20.0, factor=1.6)))


def test_jolts_are_as_frequent_as_their_spacing_says():
    spacing = 5.0
    found = levels(a_trace(seconds=400), Vibration(0.0, spacing, 50.0), 1.0, draws=5)
    jolted = (found > energy_level(power_load(0.5, 1.0, 20.0))).mean()
    assert jolted == pytest.approx(0.5 / spacing, rel=0.15)


def baseline_of(traces, vibration):
    """What would be published if the vibration were real."""
    names = {"safety": ["clutter 0"], "energy": ["power 1", "power 1.4"], "success": ["clutter 0", "power 1.4"]}
    blank = {table: dict.fromkeys(rows, 0.0) for table, rows in names.items()}
    expected = {trace.variant: (0.0, 0.0) for trace in traces}
    found = targets(traces, vibration, blank, expected, LIMITS, QUANTILES)
    groups = {"safety": "time above the safety", "energy": "time above the energy", "success": "success"}
    own = {
        table: {one.name: one.ours for one in found if one.group.startswith(group)} for table, group in groups.items()
    }
    risks, energies = (
        {one.name: one.ours for one in found if one.group == group}
        for group in ("expected safety risk", "expected energy")
    )
    return own, {variant: (risks[variant], energies[variant]) for variant in expected}


def test_fit_finds_the_vibration_that_was_published():
    traces = [a_trace(f"f2_v{index}_r1", speed, 300) for index, speed in ((1, 0.3), (2, 0.5), (3, 0.75))]
    true = Vibration(1.0, 8.0, 24.0)
    baseline, expected = baseline_of(traces, true)
    start = Vibration(1.0, 14.0, 16.0)
    found = fit(traces, 1.0, start, baseline, expected, LIMITS, QUANTILES)
    before, after = (loss(targets(traces, one, baseline, expected, LIMITS, QUANTILES)) for one in (start, found))
    assert after < 0.3 * before
    assert found.spacing == pytest.approx(true.spacing, rel=0.2)
    assert found.jolt == pytest.approx(true.jolt, rel=0.2)


def test_success_needs_all_four_conditions():
    def rate(**changes):
        blank = {"safety": {}, "energy": {}, "success": {"clutter 0": 0.0}}
        found = targets([a_trace(**changes)], STILL, blank, {}, LIMITS, QUANTILES)
        return next(one.ours for one in found if one.group == "success, %")

    calm = np.full(400, 0.2)
    assert rate(risk=calm) == 100.0
    assert rate(risk=calm, reached=False) == 0.0
    assert rate(risk=np.full(400, 0.45)) == 0.0
    assert rate() == 0.0  # risk above its threshold for 5 % of the time
    assert rate(risk=calm, acceleration=np.full((40, SAMPLES), 30.0)) == 0.0
