"""Processes, commands that start them, and calls to the master and to nodes."""
