"""R1: watches what runs, what should run, and the levels of quality attributes."""
