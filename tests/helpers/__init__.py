"""What tests of several packages share."""

from node_kit.ros.connections import connect_to_all

connect_to_all()  # nodes of tests hear all that the nodes under test say
