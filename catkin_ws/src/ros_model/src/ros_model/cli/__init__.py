"""The commands of `rosmodel`, one module each; `rosmodel` lists them and imports only the one that is run."""

BAD_INPUT = 2
"""Exit status for a file that can't be read or used; 1 says that it can, and that something is wrong in it."""
