"""ROS messages from what the simulation holds, and back. No rospy: missions in lockstep use them too."""
