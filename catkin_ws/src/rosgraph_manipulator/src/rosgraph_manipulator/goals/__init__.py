"""The pending goal of an action across changes of its server. Pure."""
