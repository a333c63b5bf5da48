"""What navigation takes on the way across the factory floor: a controller's step, a global plan, a costmap update.

Medians over a mission in lockstep on route r2, as it is planned and driven there; of plans, the first ones, over the
whole floor.
"""

from __future__ import annotations

import functools
import statistics
import tempfile
import time
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

import rospkg
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.io.lockstep_setup import set_up
from metacontrol_experiments.mission.settings import Settings
from move_base.control.dwa import DwaController
from move_base.costmap.costmap import Costmap
from move_base.navigation.navigator import Navigator
from support.figures import LIMIT, entry

if TYPE_CHECKING:
    from collections.abc import Callable

_MEASURED = (
    ("dwa_step", DwaController, "follow", 1.0),
    ("global_plan", Navigator, "plan_between", 8.0),
    ("costmap_update", Costmap, "update", 2.0),
)
"""Name, class, method, and the limit in ms: what the variants' rates leave."""
_SECONDS = 20.0  # simulated
_FIRST_PLANS = 20


def run() -> list[dict[str, Any]]:
    """Return the entries `dwa_step`, `global_plan` and `costmap_update`: ms."""
    times: defaultdict[str, list[float]] = defaultdict(list)
    route = read_route(Path(rospkg.RosPack().get_path("metacontrol_sim")) / "worlds" / "routes.yaml", "r2")
    with tempfile.TemporaryDirectory(prefix="bench_") as folder, ExitStack() as patches:
        for name, owner, method, _ in _MEASURED:
            timed = _timed(getattr(owner, method), times[name])
            patches.enter_context(mock.patch.object(owner, method, timed))
        set_up(Settings(route, Path(folder), manager="none", timeout_s=_SECONDS)).run()
    times["global_plan"] = times["global_plan"][:_FIRST_PLANS]
    return [
        entry(name, statistics.median(times[name]), "ms", len(times[name]), LIMIT, limit)
        for name, _, _, limit in _MEASURED
    ]


def _timed(method: Callable[..., Any], times: list[float]) -> Callable[..., Any]:
    @functools.wraps(method)
    def timed(*arguments: Any, **options: Any) -> Any:
        began = time.perf_counter()
        try:
            return method(*arguments, **options)
        finally:
            times.append(1000.0 * (time.perf_counter() - began))

    return timed
