"""Pure functions of numbers that simulator, observers and navigation share."""
