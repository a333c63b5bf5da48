"""Missions of D2 on ROS, as `metacontrol run` drives them."""

from __future__ import annotations

import subprocess

_DEADLINE_S = 300.0


def drive(folder: str, *options: str) -> None:
    """Drive a mission that leaves its files in a folder; it need not reach its goal.

    Raises:
        RuntimeError: it could not be driven.
    """
    done = subprocess.run(
        ["metacontrol", "run", "--quiet", *options, "--output", folder],
        timeout=_DEADLINE_S,
        check=False,
        stderr=subprocess.PIPE,
        text=True,
    )
    if done.returncode not in (0, 1):  # 1: the goal was not reached within the time
        raise RuntimeError(f"the mission ended with status {done.returncode}: {done.stderr.strip()}")
