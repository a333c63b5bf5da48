"""What the nodes of the cell share, and the observer that it adds to the meta-controller."""
