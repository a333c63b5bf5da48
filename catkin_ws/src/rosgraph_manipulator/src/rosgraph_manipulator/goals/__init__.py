"""The pending goal of an action, which outlives its server. Pure."""
