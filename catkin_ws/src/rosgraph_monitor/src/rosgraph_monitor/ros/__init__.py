"""ROS shells: the node monitor and its parts, and the commands that are nodes."""
