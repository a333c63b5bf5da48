"""The commands `explain`, `feasible`, `replay` and `vocabulary`, one module each."""
