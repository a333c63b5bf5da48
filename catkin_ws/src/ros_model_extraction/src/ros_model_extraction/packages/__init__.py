"""Packages and launch files."""
