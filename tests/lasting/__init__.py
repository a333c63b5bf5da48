"""One system that lives for hours: goal after goal, fault after fault, and its memory, descriptors and latencies."""
