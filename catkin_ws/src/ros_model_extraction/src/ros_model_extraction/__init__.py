"""Models from what is there already: the running graph, the source code of packages, launch files.

What can't be known is said in the model, with its place: a name or type is never guessed, and nothing is dropped.
"""
