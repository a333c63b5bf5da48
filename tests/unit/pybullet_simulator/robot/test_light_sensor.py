"""The light sensor measures the brightness, with noise of its own."""

import statistics

import pytest
from pybullet_simulator.robot.light_sensor import NOISE, WELL_LIT, LightSensor


@pytest.mark.parametrize("light", [1.0, 0.25])
def test_mean_is_the_true_illuminance_and_noise_a_share_of_it(light):
    sensor = LightSensor(3)
    measured = [sensor.measure(light) for _ in range(2000)]
    assert statistics.fmean(measured) == pytest.approx(light * WELL_LIT, rel=0.003)
    assert statistics.stdev(measured) == pytest.approx(NOISE * light * WELL_LIT, rel=0.1)


def test_dark_is_dark_and_a_seed_gives_one_sequence():
    one, same, other = LightSensor(3), LightSensor(3), LightSensor(4)
    assert one.measure(0.0) == 0.0
    same.measure(0.0)
    other.measure(0.0)
    assert one.measure(1.0) == same.measure(1.0) != other.measure(1.0)
