"""roscpp nodes from their source."""
