"""Launch files, the configuration file, and calls to the master."""
