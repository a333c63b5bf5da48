"""What the launcher decides: which nodes to stop, keep, start and restart, and what the end of a node means. Pure."""
