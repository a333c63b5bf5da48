"""The command rosmodel as a fixture."""

from helpers.rosmodel_command import run  # noqa: F401
