"""Launch files, processes, and calls to the master and to nodes."""
