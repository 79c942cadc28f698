/* Stored calibrations: requests read_calibration, write_calibration and erase_calibration, and their use at a start. */
#ifndef STORED_H
#define STORED_H

#include "correction.h"
#include "frame.h"

void stored_on_read(const struct frame *request);
void stored_on_write(const struct frame *request);
void stored_on_erase(const struct frame *request);

/* Prepares the correction of a configured sensor by its stored calibration; 0, or the reason why there is none. */
enum error_code stored_correction(unsigned sensor, struct correction *correction);

#endif
