"""The global plan. Pure."""
