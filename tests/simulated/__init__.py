"""The meta-controller's real cores in one process, under one simulated clock and network, while everything fails.

A seed gives one history, exactly repeatable. docs/reliability.md says what is promised and how this is used.
"""
