"""Deployments that do not last: how many there were in a row, and until when the next try waits.

Times are s of ROS time.
"""

from __future__ import annotations

import math
from dataclasses import replace

from mros1_reasoner.loop.readable_state import Running
from mros1_reasoner.loop.settings import Settings


def has_lasted(running: Running, settings: Settings, now: float) -> bool:
    """Return whether the deployed design works and has run for so long that its failures before no longer count."""
    return running.design is not None and not running.is_broken and not is_brief(running, settings, now)


def ended(running: Running, settings: Settings, now: float, how: str = "ended") -> Running:
    """Return what runs after the deployed design has ended; a try that follows brief runs waits longer and longer.

    Args:
        running: what runs.
        settings: how to behave.
        now: present time.
        how: what has happened to the design.
    """
    if not is_brief(running, settings, now):
        return replace(running, brief=0, retry_from=-math.inf, ending="")
    brief = running.brief + 1
    ending = f"{how} {now - running.deployed_at:.1f} s after it was deployed"
    return replace(running, brief=brief, retry_from=now + settings.wait_after(brief - 1), ending=ending)


def is_taken_back(running: Running, configuration: str, settings: Settings, now: float) -> bool:
    """Return whether the configuration runs again that the deployed design has replaced a short while ago."""
    return configuration == running.replaced and is_brief(running, settings, now)


def words(running: Running, reason: str) -> str:
    """Return in words that the last deployments did not last, with the reason in the error log."""
    deployments = f"{running.brief} deployments" if running.brief > 1 else "deployment"
    return f"the last {deployments} did not last ({reason})"


def is_brief(running: Running, settings: Settings, now: float) -> bool:
    """Return whether the deployed design runs for less than the time that a failure counts."""
    return now - running.deployed_at < settings.error_log_expiry
