"""The nodes rosgraph_manipulator, rosgraph_launcher and action_relay, and the clients of nodes."""
