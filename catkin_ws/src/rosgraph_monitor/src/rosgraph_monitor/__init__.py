"""R1: what runs, what should run, and how well."""
