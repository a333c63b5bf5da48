"""Packages: their executables, messages, and models made of their source."""
