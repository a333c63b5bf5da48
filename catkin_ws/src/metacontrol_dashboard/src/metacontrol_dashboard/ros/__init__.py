"""The node: what it hears, and what an operator asks of the other nodes."""
