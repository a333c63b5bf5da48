"""ROS shells: the programs that build, and the robot as they see it."""
