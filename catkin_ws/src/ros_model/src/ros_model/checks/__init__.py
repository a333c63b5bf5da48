"""What is wrong with models that read well."""
