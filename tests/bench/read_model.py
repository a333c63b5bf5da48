"""Time to read a large `.rossystem`, generated in the shape of a mobile manipulator's."""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from ros_model.reader import read_system

_SIZE = 432_000  # bytes, as large as the largest published model
_SAMPLES = 5
_PUBLISHED_S = 0.325  # middle of 0.28-0.37 s, the published pyparsing reader on that model


def run() -> list[dict[str, Any]]:
    """Return the entry `read_model`: the median in s, after import."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.rossystem"
        path.write_text(_model(), encoding="utf-8")
        times = []
        for _ in range(_SAMPLES):
            began = time.perf_counter()
            system = read_system(path)
            times.append(time.perf_counter() - began)
    if not system.components:
        raise RuntimeError("the model was read as empty")
    value = statistics.median(times)
    return [
        {
            "name": "read_model",
            "value": value,
            "unit": "s",
            "peer": "published pyparsing reader, measured earlier",
            "peer_value": _PUBLISHED_S,
            "ratio": _PUBLISHED_S / value,
            "samples": _SAMPLES,
        }
    ]


def _model() -> str:
    components: list[str] = []
    size = 0
    while size < _SIZE:
        name = f"driver_{len(components)}"
        reference = f"robot_drivers.{name}.{name}"
        parts = {
            "RosPublishers": ("RosPublisher", "RefPublisher", "joint_states"),
            "RosSubscribers": ("RosSubscriber", "RefSubscriber", "command"),
            "RosSrvServers": ("RosServiceServer", "RefServer", "driver/recover"),
        }
        blocks = [
            f"{block} {{ "
            + ", ".join(f"{kind} '/{name}/{port}_{i}' {{ {ref} '{reference}./{name}/{port}_{i}' }}" for i in range(8))
            + " }"
            for block, (kind, ref, port) in parts.items()
        ]
        values = ", ".join(
            f"RosParameter 'gain_{i}' {{ RefParameter '{reference}.gain_{i}' value {i}.5 }}" for i in range(8)
        )
        blocks.append(f"RosParameters {{ {values} }}")
        components.append(f"ComponentInterface {{ name '{name}' " + "\n ".join(blocks) + " }")
        size += len(components[-1])
    return "RosSystem { Name 'large' RosComponents (\n" + ",\n".join(components) + "\n) }\n"
