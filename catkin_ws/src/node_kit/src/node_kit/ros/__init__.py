"""The parts of the kit that need rospy."""
