"""A tactic of the manipulator."""
