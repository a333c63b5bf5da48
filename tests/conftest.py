"""Shared settings of the unit tests."""
