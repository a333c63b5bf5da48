"""A page that shows a system with a meta-controller, live or recorded, and takes what an operator asks for."""
