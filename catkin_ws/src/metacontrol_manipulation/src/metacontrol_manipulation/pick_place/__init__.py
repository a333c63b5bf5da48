"""Which block goes where next, by which arm, from what is perceived. Pure."""
