"""Threads and connections of nodes."""
