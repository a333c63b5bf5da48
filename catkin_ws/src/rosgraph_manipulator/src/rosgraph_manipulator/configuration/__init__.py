"""Configurations: which launch file deploys which, and what they consist of."""
