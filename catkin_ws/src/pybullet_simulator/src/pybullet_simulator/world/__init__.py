"""Boxes, obstacles and people on the floor. Pure."""
