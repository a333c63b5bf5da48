"""State of nodes, topics, batteries and components over time. Pure."""
