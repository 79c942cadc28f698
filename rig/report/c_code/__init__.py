"""C functions that correct readings, of which `calibration.h` is made."""
