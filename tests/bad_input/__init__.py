"""Mutated inputs for everything that reads a file or takes a message: nothing may fall over, hang or grow."""
