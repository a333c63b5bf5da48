"""An observer of a quality level."""
