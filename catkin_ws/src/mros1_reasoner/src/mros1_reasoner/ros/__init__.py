"""The ROS shell: topics, services, the request to the manipulator, logs."""
