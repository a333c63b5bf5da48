"""A module of observers that can't be imported."""

raise RuntimeError("broken at its first line")
