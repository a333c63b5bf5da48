"""ROS shells: the node simulator and the drivers of the sensors."""
