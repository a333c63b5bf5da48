"""The statuses on /diagnostics, and how they are shown. Pure."""
