"""The local controller. Pure."""
