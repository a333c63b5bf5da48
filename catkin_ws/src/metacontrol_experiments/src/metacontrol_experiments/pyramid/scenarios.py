"""Scenarios of D1: what goes wrong while the pyramid is built, drawn by a seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator

MANIPULATION = "manipulation"
"""What missions of D1 are called, beside those of navigation."""
ARMS = ("left", "right")
NO_ARM = "none"
_BRIGHT, _DIM = (0.75, 1.0), (0.02, 0.05)
"""Light in which only the camera's setting for bright, or only that for dim light finds tags."""
_STREAM = 41

_OBSTACLE_X, _OBSTACLE_Y = (-0.30, -0.20), (0.14, 0.18)
"""m in the map frame: across the way from an arm's blocks to the pyramid; y on the arm's own side."""


@dataclass(frozen=True)
class Light:
    """The light changes, to a level from 0 (dark) to 1."""

    level: float

    def __str__(self) -> str:
        return f"light:{self.level:.2f}"


@dataclass(frozen=True)
class Obstacle:
    """A wall is put in the way of an arm that carries a block, and taken away after the arm has stopped.

    Attributes:
        arm: left or right.
        x: m, the centre in the map frame.
        y: likewise.
    """

    arm: str
    x: float
    y: float

    def __str__(self) -> str:
        return f"obstacle:{self.arm}"


@dataclass(frozen=True)
class Release:
    """Somebody releases an arm from its safety stop."""

    arm: str

    def __str__(self) -> str:
        return f"release:{self.arm}"


@dataclass(frozen=True)
class Kill:
    """The node of a component is killed."""

    component: str

    def __str__(self) -> str:
        return f"component:{self.component}"


@dataclass(frozen=True)
class Strike:
    """One thing that happens.

    Attributes:
        what: happens.
        placed: so many blocks stand in their places before.
        after: s since the strike before it, or since the start.
    """

    what: Light | Obstacle | Release | Kill
    placed: int = 0
    after: float = 0.0

    def __str__(self) -> str:
        return f"{self.what}@placed:{self.placed}" + (f",after:{self.after:g}" if self.after else "")


@dataclass(frozen=True)
class Scenario:
    """What a mission meets.

    Attributes:
        number: 0 to 4.
        light: at the start.
        stopped_arm: left, right or none, at the start.
        configurations: deployed at the start, by commas.
        strikes: in their order.
        can_be_built: a design is left for every strike.
    """

    number: int
    light: float = 1.0
    stopped_arm: str = NO_ARM
    configurations: str = "fd2"
    strikes: tuple[Strike, ...] = ()
    can_be_built: bool = True


UNDISTURBED = 0
TITLES = {
    UNDISTURBED: "nothing goes wrong",
    1: "one arm works, and the light changes and changes back",
    2: "an arm meets an obstacle",
    3: "both, the arm is free again, and the camera's driver dies",
    4: "both arms meet an obstacle: no design is left",
}
"""The number of the one in which nothing goes wrong; and titles by number."""


def draw(number: int, seed: int) -> Scenario:
    """Return a scenario with its moments, levels and places drawn by a seed.

    Raises:
        KeyError: there is none of this number.
    """
    rng = np.random.default_rng([seed, _STREAM, number])
    return {UNDISTURBED: _undisturbed, 1: _light, 2: _obstacle, 3: _both, 4: _both_arms}[number](rng)


def _undisturbed(_rng: Generator) -> Scenario:
    return Scenario(UNDISTURBED)


def _light(rng: Generator) -> Scenario:
    """Return a change of the light and one back, while one arm builds from the start, so that tags are needed."""
    stopped, working = _arms(rng)
    levels = [float(rng.uniform(*_BRIGHT)), float(rng.uniform(*_DIM)), float(rng.uniform(*_BRIGHT))]
    if rng.random() < 0.5:
        levels = [float(rng.uniform(*_DIM)), float(rng.uniform(*_BRIGHT)), float(rng.uniform(*_DIM))]
    first = int(rng.integers(1, 4))
    second = int(rng.integers(first + 2, 6))  # a block that is on its way needs no tags any more
    setting = "fd2_2" if levels[0] < _BRIGHT[0] else "fd2_1"
    return Scenario(
        1,
        light=levels[0],
        stopped_arm=stopped,
        configurations=f"fd1_{working},fd1_1,{setting}",
        strikes=(Strike(Light(levels[1]), first), Strike(Light(levels[2]), second)),
    )


def _obstacle(rng: Generator) -> Scenario:
    arm, _ = _arms(rng)
    return Scenario(
        2, light=float(rng.uniform(*_BRIGHT)), strikes=(Strike(_obstacle_for(arm, rng), int(rng.integers(0, 3))),)
    )


def _both(rng: Generator) -> Scenario:
    """Return an arm that stops, before or after it gets dark; then a dead camera, light again, the arm free again."""
    arm, _ = _arms(rng)
    dark, light = Light(float(rng.uniform(*_DIM))), Light(float(rng.uniform(*_BRIGHT)))
    met = _obstacle_for(arm, rng)
    is_dark_first = rng.random() < 0.5
    first = (Strike(dark), Strike(met, 1, 2.0)) if is_dark_first else (Strike(met), Strike(dark, 1, 8.0))
    last = (Strike(Kill("camera"), 2, 8.0), Strike(light, 3, 5.0), Strike(Release(arm), 4, 5.0))
    return Scenario(3, light=float(rng.uniform(*_BRIGHT)), strikes=(*first, *last))


def _both_arms(rng: Generator) -> Scenario:
    first, second = _arms(rng)
    strikes = (Strike(_obstacle_for(first, rng)), Strike(_obstacle_for(second, rng), 1, 8.0))
    return Scenario(4, light=float(rng.uniform(*_BRIGHT)), strikes=strikes, can_be_built=False)


def _arms(rng: Generator) -> tuple[str, str]:
    """Return both arms in an order that is drawn."""
    first = int(rng.integers(0, 2))
    return ARMS[first], ARMS[1 - first]


def _obstacle_for(arm: str, rng: Generator) -> Obstacle:
    side = 1.0 if arm == "left" else -1.0
    return Obstacle(arm, float(rng.uniform(*_OBSTACLE_X)), side * float(rng.uniform(*_OBSTACLE_Y)))
