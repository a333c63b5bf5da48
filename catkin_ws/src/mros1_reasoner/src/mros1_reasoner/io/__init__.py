"""Files: ontologies, the parameters that name them, bags, the generator `tomasys`. No other room but cli/ touches one."""
