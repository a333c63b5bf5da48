"""Pellet in a process of its own. This room starts processes, waits for them and reads their answers."""
