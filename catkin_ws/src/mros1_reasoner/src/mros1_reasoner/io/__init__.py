"""Files: ontologies, the parameters that name them, bags, and the generator `tomasys`, which writes an ontology."""
