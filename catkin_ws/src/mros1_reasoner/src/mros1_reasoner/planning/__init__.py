"""R3: which design to deploy, and why each other one was not taken. Pure."""
