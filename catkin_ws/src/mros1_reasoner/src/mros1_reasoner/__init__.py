"""R2 and R3: the knowledge base, reasoning and planning of the meta-controller."""
