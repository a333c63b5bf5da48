"""The commands `explain` and `replay`."""
