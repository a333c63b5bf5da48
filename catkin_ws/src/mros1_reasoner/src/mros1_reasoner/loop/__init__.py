"""The loop from facts to decisions. Pure."""
