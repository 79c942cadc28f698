"""What a series of calibrations says: arrays in, results out, no database."""
