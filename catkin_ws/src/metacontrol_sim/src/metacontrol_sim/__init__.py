"""Nodes of the demonstrators: power meter, goal sender, text over the robot."""
