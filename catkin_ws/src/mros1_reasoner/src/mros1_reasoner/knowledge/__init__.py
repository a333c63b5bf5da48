"""The TOMASys knowledge base and its vocabulary."""
