"""The RosModel languages: models of nodes and systems, and what is generated from them."""
