"""What stands, lies and walks on the floor. Pure."""
