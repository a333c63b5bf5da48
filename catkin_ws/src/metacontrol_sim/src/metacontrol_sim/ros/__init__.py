"""ROS shells of the demonstrator: power meter, goal, text for RViz."""
