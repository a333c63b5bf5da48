"""From a goal to velocities: the state machine. Pure."""
