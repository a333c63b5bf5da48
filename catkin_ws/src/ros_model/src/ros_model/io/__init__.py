"""Files, installed packages, the ROS master, graphviz: all that reaches outside of the process."""
