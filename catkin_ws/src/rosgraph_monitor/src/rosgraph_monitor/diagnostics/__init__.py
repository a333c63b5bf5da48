"""What is said on /diagnostics, and how it is shown. Pure."""
