"""The running graph as plain data. Pure."""
