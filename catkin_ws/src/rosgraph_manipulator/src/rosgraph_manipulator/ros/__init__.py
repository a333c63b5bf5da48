"""The nodes rosgraph_manipulator and action_relay, and the clients of nodes."""
