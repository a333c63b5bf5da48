"""ROS shells of move_base."""
