"""Commands that are no ROS nodes."""
