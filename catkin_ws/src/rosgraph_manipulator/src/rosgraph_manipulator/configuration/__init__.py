"""Configurations: the launch file of each, the nodes and parameters in it, and how two of them differ. Pure."""
