"""The commands: one module each, `main` lists them."""
