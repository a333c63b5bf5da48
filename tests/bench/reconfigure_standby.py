"""The same as reconfigure_restart, with a warm process standing by."""

from __future__ import annotations

from typing import Any

from reconfigure_restart import measure


def run() -> list[dict[str, Any]]:
    """Return median and 95th percentile, and the median of each phase, in s, wall, at real-time factor 1."""
    return measure("reconfigure_standby", standby=True)
