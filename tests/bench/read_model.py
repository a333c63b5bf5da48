"""Time to read a large `.rossystem`, in the shape of a mobile manipulator's, and to check all models of D2."""

from __future__ import annotations

import statistics
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from ros_model.io.models import read_system
from support.figures import entry, seconds

_SIZE = 432_000  # bytes, as large as the largest published model
_SAMPLES = 5
_D2 = Path(__file__).parents[2] / "catkin_ws" / "src" / "metacontrol_sim" / "models"
_UNNOTICED_S = 1.0
_PUBLISHED_S = 0.325  # middle of 0.28-0.37 s, the published pyparsing reader on that model


def run() -> list[dict[str, Any]]:
    """Return the entries `read_model`, a median in s after import, and `check_models`, the command's start included."""
    return [_read(), _check()]


def _read() -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.rossystem"
        path.write_text(_model(), encoding="utf-8")
        if not read_system(path).components:
            raise RuntimeError("the model was read as empty")
        value = statistics.median(seconds(lambda: read_system(path)) for _ in range(_SAMPLES))
    return entry("read_model", value, "s", _SAMPLES, "published pyparsing reader, measured earlier", _PUBLISHED_S)


def _check() -> dict[str, Any]:
    def check() -> None:
        subprocess.run(["rosmodel", "check", str(_D2)], check=True, stdout=subprocess.DEVNULL)

    value = statistics.median(seconds(check) for _ in range(_SAMPLES))
    return entry("check_models", value, "s", _SAMPLES, "what a user waits for without noticing", _UNNOTICED_S)


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
