"""Makes models from what exists already: the running graph, the source code of packages, launch files.

The model marks what can't be known, with its place: it never guesses a name or type, and drops nothing.
"""
