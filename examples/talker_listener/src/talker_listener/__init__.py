"""What this robot adds to the meta-controller: an observer, and a utility function."""
