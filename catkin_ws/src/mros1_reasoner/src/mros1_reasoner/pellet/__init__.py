"""Pellet in a process of its own, and what makes its analyses quick."""
