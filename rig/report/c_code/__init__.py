"""C functions that correct readings, for `calibration.h`."""
