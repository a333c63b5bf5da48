"""Results of many missions: levels of variants, comparison of engines, tables. Pure."""
