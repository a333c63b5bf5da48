"""ROS shells: the node reasoner and its parts."""
