"""Launch files, the configuration file, processes, and calls to the master and to nodes."""
