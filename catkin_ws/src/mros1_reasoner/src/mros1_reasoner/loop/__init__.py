"""The loop from facts to decisions: state, causes, deliberation, an operator's commands, the journal."""
