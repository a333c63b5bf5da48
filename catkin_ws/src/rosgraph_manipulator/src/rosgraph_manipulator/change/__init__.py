"""Changes of configuration: the plans, their order, the way back, the requests and the journal. Pure."""
