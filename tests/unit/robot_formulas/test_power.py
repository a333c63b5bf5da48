import math

import pytest
from robot_formulas.power import LARGEST, Battery, PowerError, PowerMeter, check_factor, energy_level, power_load


@pytest.mark.parametrize(
    ("speed", "rate", "factor", "energy"),
    [(0.3, 15.0, 1.0, 0.165), (0.5, 20.0, 1.0, 0.26), (0.75, 25.0, 1.0, 0.37), (0.75, 25.0, 1.6, 0.617)],
)
def test_load_at_steady_speed_gives_the_published_energy(speed, rate, factor, energy):
    assert energy_level(power_load(speed, 0.0, rate, factor)) == pytest.approx(energy, abs=0.005)


def test_load_is_clipped():
    assert power_load(0.0, 0.0, 0.0) == 0.2
    assert power_load(5.0, 40.0, 50.0) == 5.0


@pytest.mark.parametrize("factor", [-0.1, math.nan, math.inf, 1e308])
def test_bad_factor_is_refused(factor):
    with pytest.raises(PowerError, match="refused"):
        check_factor(factor)


def test_load_of_values_that_are_not_finite_is_refused():
    with pytest.raises(PowerError, match="finite"):
        power_load(math.nan, 0.0, 0.0)


def test_meter_takes_the_largest_values_and_the_rate_since_the_last_tick():
    meter = PowerMeter(10.0)
    for speed, acceleration in ((0.2, 1.0), (0.5, -3.0), (0.1, 4.0)):
        meter.add_speed(speed)
        meter.add_acceleration(acceleration)
    for _ in range(40):
        meter.add_command()
    assert meter.tick(12.0) == pytest.approx(1.3 * 0.5 + 0.1 * 4.0 + 0.04 * 20.0)
    assert meter.tick(13.0) == 0.2


@pytest.mark.parametrize(("speed", "counts"), [(-0.3, 0.3), (-0.1, 0.0), (-0.75, 0.75)])
def test_driving_backwards_takes_as_much_as_driving_ahead_but_backing_off_counts_as_published(speed, counts):
    meter = PowerMeter(0.0)
    meter.add_speed(speed)
    meter.add_speed(0.0)
    for _ in range(20):
        meter.add_command()
    assert meter.tick(1.0) == pytest.approx(1.3 * counts + 0.04 * 20.0)


def test_meter_survives_a_clock_that_stands_or_runs_backwards():
    meter = PowerMeter(10.0)
    assert meter.tick(10.0) is None
    assert meter.tick(3.0) is None
    meter.add_speed(1.0)
    assert meter.tick(4.0) == pytest.approx(1.3)


def test_meter_whose_clock_comes_late_does_not_count_the_time_before_it():
    meter = PowerMeter(None)
    meter.add_speed(5.0)
    assert meter.tick(1000.0) is None
    for _ in range(20):
        meter.add_command()
    assert meter.tick(1001.0) == pytest.approx(0.04 * 20.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.7e308, -1.7e308])
def test_meter_refuses_what_is_not_finite_or_absurd(value):
    meter = PowerMeter(0.0)
    for take in (meter.add_speed, meter.add_acceleration):
        with pytest.raises(PowerError, match="of a robot"):
            take(value)
    assert meter.tick(1.0) == 0.2


def test_largest_values_give_the_full_load():
    meter = PowerMeter(0.0)
    meter.factor = check_factor(LARGEST)
    meter.add_speed(-LARGEST)
    meter.add_acceleration(LARGEST)
    for _ in range(100):
        meter.add_command()
    assert meter.tick(1e-300) == 5.0


def test_meter_starts_anew_also_where_it_can_not_tell_the_load():
    meter = PowerMeter(0.0)
    meter.factor = math.inf
    with pytest.raises(PowerError):
        meter.tick(1.0)
    meter.factor = 1.0
    for _ in range(20):
        meter.add_command()
    assert meter.tick(2.0) == pytest.approx(0.04 * 20.0)


def test_full_load_empties_the_battery_in_three_hours():
    battery = Battery()
    battery.drain(5.0, 1.5 * 3600.0)
    assert battery.charge == pytest.approx(0.5)
    battery.drain(5.0, 2.0 * 3600.0)
    assert battery.charge == 0.0
    assert battery.current(1.0) < 0.0


def test_energy_level_follows_the_published_scale():
    assert energy_level(0.2) == 0.0
    assert energy_level(2.6) == pytest.approx(0.5)
    assert energy_level(9.0) == 1.0
    with pytest.raises(ValueError, match="finite"):
        energy_level(math.nan)
