"""Checks of models that have no syntax error."""
