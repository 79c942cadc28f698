"""Statistics of a series of calibrations: arrays in, results out, no database."""
