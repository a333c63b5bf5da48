"""Changes the configuration of a running system: the last step of the adaptation loop, R4."""
