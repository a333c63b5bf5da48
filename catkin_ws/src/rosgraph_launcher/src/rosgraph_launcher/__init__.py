"""Owns the processes of nodes: starts them as roslaunch does, restarts those that die, ends them in time."""
