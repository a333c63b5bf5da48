"""R3: choose a design, and say why each other design was not taken."""
