"""Run the loop again over a recorded run, and compare its decisions with the recorded ones."""
