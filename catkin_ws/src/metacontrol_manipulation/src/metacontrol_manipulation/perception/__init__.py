"""What the mast camera tells of the work cell: where it is, where blocks lie, which slots are filled. Pure."""
