"""The commands `rosmodel extract` and `rosmodel snapshot`."""
