"""Kinematics and collision-free motion of a Franka Panda, in the frame of its base (link0); pure."""
