"""Threads, connections to nodes, and resources of processes."""
