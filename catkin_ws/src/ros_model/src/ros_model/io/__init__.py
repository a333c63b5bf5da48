"""The running graph, and drawings."""
