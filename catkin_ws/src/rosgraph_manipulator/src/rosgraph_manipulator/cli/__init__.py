"""The commands `plan`, `request` and `status`."""
