"""The running graph against the desired system. Pure."""
