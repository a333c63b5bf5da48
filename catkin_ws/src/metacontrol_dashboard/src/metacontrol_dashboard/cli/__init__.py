"""The commands `metacontrol view` and `metacontrol export`."""
