"""Files: ontologies, the parameters that name them, bags, the generator `tomasys`; only cli/ touches files, too."""
