"""Fixtures of the dashboard's tests."""

from helpers.small_run import bag  # noqa: F401
