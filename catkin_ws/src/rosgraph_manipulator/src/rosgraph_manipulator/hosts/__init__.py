"""Launchers on several hosts, as one: which one has a node, what each is asked, what they tell together. Pure."""
