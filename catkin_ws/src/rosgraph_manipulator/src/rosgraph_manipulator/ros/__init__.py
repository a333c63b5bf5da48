"""ROS shells: the nodes rosgraph_manipulator, rosgraph_launcher and action_relay."""
