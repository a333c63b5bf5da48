"""The loop from facts to decisions: state, causes, deliberation, operator's commands, journal."""
