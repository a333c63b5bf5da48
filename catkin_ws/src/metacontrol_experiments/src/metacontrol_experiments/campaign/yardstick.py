"""The yardstick: how D2's disturbances fit the published baseline, and the constants that fit best.

A baseline mission drives the same way whatever the floor's vibration and the power factor are, because nothing adapts.
So one trace of a mission tells its energy for any constants of the vibration and for any power contingency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from robot_formulas.power import (
    ACCELERATION_COEFFICIENT,
    MAX_LOAD,
    MIN_LOAD,
    RATE_COEFFICIENT,
    SPEED_COEFFICIENT,
)
from scipy.optimize import minimize

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

SAMPLES = 50
"""Samples of the IMU in a second, over which the published power model takes the largest acceleration."""
STRIKE_SHARE = 0.6
"""Share of the way after which a power contingency strikes (published tool)."""
DRAWS = 20
"""Random draws of the vibration for each second of a trace."""

SHARE_WEIGHT, SUCCESS_WEIGHT, LEVEL_WEIGHT, SINGLE_WEIGHT = 1.0 / 0.5, 1.0 / 5.0, 0.5 / 0.05, 0.3 / 0.05
"""Weights of residuals: shares of time (points of per cent), success (points), expected levels, the single run. The
tables count most, the single run least: they cannot all be met."""


@dataclass(frozen=True)
class Trace:
    """What a baseline mission without power contingency leaves.

    Attributes:
        variant: name of the configuration.
        route: name.
        seed: of everything random.
        clutter: number of obstacles.
        reached: whether the goal was reached.
        duration_s: simulated s.
        risk: true safety risk, at 10 Hz (N,).
        acceleration: true forward acceleration, m/s2, a row for each second (S, SAMPLES).
        speed: of the base, m/s, likewise.
        forward: largest forward speed in each second, m/s (S,).
        rate: velocity commands in each second, Hz (S,).
        share: largest share of the way done until each second's end, Euclidean (S,).
    """

    variant: str
    route: str
    seed: int
    clutter: int
    reached: bool
    duration_s: float
    risk: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    speed: NDArray[np.float64]
    forward: NDArray[np.float64]
    rate: NDArray[np.float64]
    share: NDArray[np.float64]


@dataclass(frozen=True)
class Vibration:
    """The constants of the floor's vibration; those of `pybullet_simulator.robot.motion_sensors`.

    Attributes:
        bulk: standard deviation between jolts, m/s2 per m/s.
        spacing: m between two jolts on average.
        jolt: scale of a jolt's Rayleigh distribution, m/s2 per m/s.
    """

    bulk: float
    spacing: float
    jolt: float


@dataclass(frozen=True)
class Target:
    """A published fact about the baseline beside ours.

    Attributes:
        group: of facts.
        name: within the group.
        published: figure.
        ours: figure.
        weight: of the residual.
    """

    group: str
    name: str
    published: float
    ours: float
    weight: float

    @property
    def residual(self) -> float:
        """Ours less the published figure."""
        return self.ours - self.published


def levels(trace: Trace, vibration: Vibration, factor: float, draws: int = DRAWS) -> NDArray[np.float64]:
    """Return energy levels (draws, S) of a mission in which the power load is multiplied on the way.

    The published power model (robot_formulas.power): in each second the largest forward speed, the largest forward
    acceleration, the rate of commands.

    Args:
        trace: of the mission.
        vibration: constants.
        factor: of the load, after STRIKE_SHARE of the way.
        draws: how often the vibration is drawn; the same arguments give the same draws.
    """
    rng = np.random.default_rng([trace.seed, 11])
    shape = (draws, *trace.speed.shape)
    shaken = trace.acceleration + vibration.bulk * trace.speed * rng.standard_normal(shape)
    jolts = rng.random(shape) < trace.speed / SAMPLES / vibration.spacing
    shaken += jolts * vibration.jolt * trace.speed * rng.rayleigh(size=shape)
    peak = np.maximum(shaken.max(axis=2), 0.0)
    load = SPEED_COEFFICIENT * np.maximum(trace.forward, 0.0) + ACCELERATION_COEFFICIENT * peak
    load = (load + RATE_COEFFICIENT * trace.rate) * np.where(trace.share >= STRIKE_SHARE, factor, 1.0)
    return (np.clip(load, MIN_LOAD, MAX_LOAD) - MIN_LOAD) / (MAX_LOAD - MIN_LOAD)


def targets(
    traces: Sequence[Trace],
    vibration: Vibration,
    baseline: Mapping[str, Mapping[str, float]],
    expected: Mapping[str, tuple[float, float]],
    limits: Mapping[str, float],
    quantiles: Mapping[str, float],
) -> list[Target]:
    """Return the published facts beside what traces and constants give.

    Args:
        traces: of the nine starts with all clutters, and of all variants without.
        vibration: constants.
        baseline: the baseline's published tables in per cent: safety, energy and success, each row -> figure.
        expected: variant -> published expected levels of safety (risk) and energy.
        limits: quality attribute -> level that must not be exceeded.
        quantiles: quality -> which quantile of a mission's levels its expected level is.
    """
    starts = [trace for trace in traces if "_v2_" in trace.variant]
    plain = [trace for trace in starts if not trace.clutter]
    found = []
    for row, figure in baseline["safety"].items():
        clutter = int(row.split()[1])
        shares = [_above(trace.risk, limits["safety"]) for trace in starts if trace.clutter == clutter]
        found.append(Target("time above the safety threshold, %", row, figure, 100.0 * _mean(shares), SHARE_WEIGHT))
    for row, figure in baseline["energy"].items():
        factor = float(row.split()[1])
        shares = [_above(levels(trace, vibration, factor), limits["energy"]) for trace in plain]
        found.append(Target("time above the energy threshold, %", row, figure, 100.0 * _mean(shares), SHARE_WEIGHT))
    for row, figure in baseline["success"].items():
        kind, value = row.split()
        group = [trace for trace in starts if kind == "power" or trace.clutter == int(value)]
        factors = (float(value),) if kind == "power" else (1.0, 1.2, 1.4, 1.6)
        rates = [_success(trace, vibration, factor, limits) for trace in group for factor in factors]
        found.append(Target("success, %", row, figure, 100.0 * _mean(rates), SUCCESS_WEIGHT))
    found += _expected(traces, vibration, expected, quantiles)
    single = [trace for trace in plain if trace.variant.startswith("f2")]
    energies = [levels(trace, vibration, 1.0) for trace in single]
    facts = {
        "mean energy": (0.38, _mean([float(level.mean()) for level in energies])),
        "share above 0.62": (0.08, _mean([_above(level, limits["energy"]) for level in energies])),
        "mean safety risk": (0.47, _mean([float(trace.risk.mean()) for trace in single])),
        "share above 0.6": (0.10, _mean([_above(trace.risk, limits["safety"]) for trace in single])),
    }
    return found + [Target("single run", name, *pair, SINGLE_WEIGHT) for name, pair in facts.items()]


def loss(found: Sequence[Target]) -> float:
    """Return the weighted sum of squared residuals; each group of facts counts by its mean."""
    groups = {target.group for target in found}
    return sum(
        _mean([(target.weight * target.residual) ** 2 for target in found if target.group == group]) for group in groups
    )


def fit(
    traces: Sequence[Trace],
    bulk: float,
    start: Vibration,
    baseline: Mapping[str, Mapping[str, float]],
    expected: Mapping[str, tuple[float, float]],
    limits: Mapping[str, float],
    quantiles: Mapping[str, float],
) -> Vibration:
    """Return the spacing and size of jolts that fit best, with a given bulk (`targets` has the other arguments)."""

    def at(point: NDArray[np.float64]) -> float:
        vibration = Vibration(bulk, math.exp(point[0]), math.exp(point[1]))
        return loss(targets(traces, vibration, baseline, expected, limits, quantiles))

    first = np.log([start.spacing, start.jolt])
    best = minimize(at, first, method="Nelder-Mead", options={"maxiter": 40, "xatol": 0.01, "fatol": 0.01})
    return Vibration(bulk, float(math.exp(best.x[0])), float(math.exp(best.x[1])))


def _expected(
    traces: Sequence[Trace],
    vibration: Vibration,
    expected: Mapping[str, tuple[float, float]],
    quantiles: Mapping[str, float],
) -> list[Target]:
    found = []
    for variant, (risk, energy) in expected.items():
        own = [trace for trace in traces if trace.variant == variant and not trace.clutter]
        if own:
            risks = [float(np.quantile(trace.risk, quantiles["safety"])) for trace in own]
            share = quantiles["energy"]
            energies = [float(np.quantile(levels(trace, vibration, 1.0), share, axis=1).mean()) for trace in own]
            found.append(Target("expected safety risk", variant, risk, _mean(risks), LEVEL_WEIGHT))
            found.append(Target("expected energy", variant, energy, _mean(energies), LEVEL_WEIGHT))
    return found


def _success(trace: Trace, vibration: Vibration, factor: float, limits: Mapping[str, float]) -> float:
    """Return how probably a mission succeeds: the paper's four conditions."""
    if not trace.reached or trace.risk.mean() >= 0.4 or _above(trace.risk, limits["safety"]) >= 0.05:
        return 0.0
    above = (levels(trace, vibration, factor) > limits["energy"]).mean(axis=1)
    return float((above < 0.1).mean())


def _above(values: NDArray[np.float64], limit: float) -> float:
    return float((values > limit).mean())


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else math.nan
