"""A generator of rosmodel."""
