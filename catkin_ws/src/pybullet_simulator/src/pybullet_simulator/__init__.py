"""Worlds and robots in PyBullet."""
