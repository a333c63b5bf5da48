"""Stand-in for the navigation stack's move_base."""
