"""The commands `explain` and `replay`, one module each."""
