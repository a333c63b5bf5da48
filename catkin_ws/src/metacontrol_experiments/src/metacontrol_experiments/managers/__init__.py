"""Managers: what adapts the system in a mission, or leaves it as it is. Pure."""
