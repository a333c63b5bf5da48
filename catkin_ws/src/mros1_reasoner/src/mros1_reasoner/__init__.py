"""R2 and R3 of the MAPE-K loop: the TOMASys knowledge base, reasoning, planning."""
