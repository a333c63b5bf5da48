"""Processes and files of missions."""
