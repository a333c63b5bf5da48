"""Missions, metrics and reports."""
