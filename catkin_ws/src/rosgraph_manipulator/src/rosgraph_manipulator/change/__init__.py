"""Changes of configuration: tactics, order, journal, and supervision of what runs. Pure."""
