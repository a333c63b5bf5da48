"""A mission: routes, settings, and its course. Pure."""
