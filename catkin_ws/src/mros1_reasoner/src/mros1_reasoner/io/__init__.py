"""Files: ontologies, parameters that name them, bags. What is read goes to the rooms that decide."""
