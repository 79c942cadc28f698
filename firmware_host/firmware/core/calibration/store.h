/* One calibration per sensor in flash, which survives a power loss at any moment of its writing: the old one or the new. */
#ifndef STORE_H
#define STORE_H

#include <stdbool.h>

#include "protocol.h"

/* Reads a record in the form of the answer to read_calibration, without `reply_to`. False if there is none. */
bool store_read(unsigned sensor, struct calibration_payload *record);

/* Writes a record and sets its sequence. False if the flash failed; the old record is still there. */
bool store_write(unsigned sensor, struct calibration_payload *record);

/* Erases a record. False if the flash failed. */
bool store_erase(unsigned sensor);

#endif
