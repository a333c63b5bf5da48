"""Files, running nodes, roslaunch: all that reaches outside of the process."""
