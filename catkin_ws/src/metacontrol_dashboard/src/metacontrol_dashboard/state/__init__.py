"""What the page shows, as data that are sent piece by piece: the state, its changes, a recording. Pure."""
