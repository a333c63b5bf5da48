"""The project of a robot: metacontrol.yaml, tables of variants, families of systems."""
