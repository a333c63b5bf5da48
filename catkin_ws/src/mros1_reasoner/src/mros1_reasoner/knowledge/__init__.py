"""The TOMASys knowledge base: what models say, facts as assertions, conclusions as statuses. It touches no file."""
