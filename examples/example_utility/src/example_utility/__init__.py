"""A utility function."""
