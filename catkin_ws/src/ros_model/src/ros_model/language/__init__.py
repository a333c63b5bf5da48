"""The languages .ros and .rossystem: metamodel, grammars, reading, writing."""
