"""What the launcher decides: which nodes to stop, keep, start and restart, and which parameters to restore. Pure."""
