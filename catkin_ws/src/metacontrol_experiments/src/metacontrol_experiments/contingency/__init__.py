"""What goes wrong in a mission, and when. Pure."""
