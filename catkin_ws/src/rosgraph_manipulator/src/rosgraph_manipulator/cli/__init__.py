"""Commands: `rosrun rosgraph_manipulator plan|request|status`."""
