"""rospy nodes from their source."""
