"""Costmaps and what fills them. Pure."""
