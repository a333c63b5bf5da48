"""Parameters: read, checked, changed while it runs. Pure."""
