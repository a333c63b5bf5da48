"""A rule engine without Java."""
