"""R4: deploys a configuration of the system."""
