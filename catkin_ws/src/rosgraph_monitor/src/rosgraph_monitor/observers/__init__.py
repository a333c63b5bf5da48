"""The observers that come with the monitor."""
