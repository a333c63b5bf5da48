"""The node rosgraph_launcher, and its messages."""
