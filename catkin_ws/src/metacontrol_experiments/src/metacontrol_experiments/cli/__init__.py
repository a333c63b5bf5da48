"""The command `metacontrol`."""
