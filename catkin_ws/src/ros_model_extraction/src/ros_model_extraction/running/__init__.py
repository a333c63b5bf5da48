"""The running graph as models."""
