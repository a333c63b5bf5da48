"""Demonstrator D1: a mobile base with two arms builds a pyramid of blocks."""
