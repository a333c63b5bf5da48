"""R3: chooses a design, and says why it rejected each other one."""
