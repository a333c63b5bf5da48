"""The commands `explain`, `replay` and `vocabulary`, one module each."""
