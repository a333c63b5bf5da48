"""A folder for PYTHONPATH: a Python that starts with it imports in advance, and waits before it runs its script."""
