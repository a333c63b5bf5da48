"""Many missions: calibration of variants, comparison of engines, tables of them."""
