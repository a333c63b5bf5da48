"""Real missions on ROS while everything fails: `./mros soak --faults N`."""
