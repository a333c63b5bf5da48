"""Files of worlds, maps and robots, and the signals by which faults are told to a driver."""
