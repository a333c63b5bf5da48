import numpy as np
import pytest
from pybullet_simulator.robot.colour_camera import BRIGHT, DIM, CameraSettings, take


def photograph(level, settings, seed=0):
    light = np.full((60, 80, 3), level, dtype=np.float32)
    return take(light, settings, np.random.default_rng(seed))


def test_image_is_linear_in_light_exposure_and_gain():
    half = photograph(0.5, BRIGHT).mean()
    assert photograph(1.0, BRIGHT).mean() == pytest.approx(2.0 * half, rel=0.02)
    assert photograph(0.5, CameraSettings(2.0 * BRIGHT.exposure, BRIGHT.gain)).mean() == pytest.approx(
        2 * half, rel=0.02
    )
    assert photograph(0.5, CameraSettings(BRIGHT.exposure, 2.0)).mean() == pytest.approx(2.0 * half, rel=0.02)


def test_darkness_is_black_but_for_noise():
    image = photograph(0.0, BRIGHT)
    assert image.dtype == np.uint8
    assert 0.2 < image.mean() < 1.5


def test_too_much_light_is_white_everywhere():
    assert (photograph(0.5, DIM) == 255).all()


def test_gain_raises_noise_and_long_exposure_lowers_it():
    """At one brightness of the image: more light by exposure is better than more gain."""
    gained = photograph(0.1, CameraSettings(BRIGHT.exposure, 8.0))
    exposed = photograph(0.1, CameraSettings(8.0 * BRIGHT.exposure, 1.0))
    assert gained.mean() == pytest.approx(exposed.mean(), rel=0.02)
    assert gained.std() > 3.0 * exposed.std()


def test_same_seed_gives_the_same_image():
    assert (photograph(0.3, BRIGHT, 1) == photograph(0.3, BRIGHT, 1)).all()
    assert (photograph(0.3, BRIGHT, 1) != photograph(0.3, BRIGHT, 2)).any()


def test_bright_things_veil_dark_ones():
    light = np.zeros((60, 80, 3), dtype=np.float32)
    light[:, :70] = 1.0
    rng = np.random.default_rng(0)
    assert take(light, BRIGHT, rng)[:, 70:].mean() > photograph(0.0, BRIGHT).mean() + 0.3
