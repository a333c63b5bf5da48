"""How an arm takes and puts a block: motions and grips, planned to their end before they begin. Pure."""
