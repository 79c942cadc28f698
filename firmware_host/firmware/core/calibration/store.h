/* One calibration per sensor in flash, which survives a power loss at any moment of its writing: the old one or the new. */
#ifndef STORE_H
#define STORE_H

#include <stdbool.h>

#include "protocol.h"

/* A record is the answer to read_calibration, without whom it answers. False when there is none. */
bool store_read(unsigned sensor, struct calibration_payload *record);

/* The record's sequence is given here. False when the flash did not take it: the old record is still there. */
bool store_write(unsigned sensor, struct calibration_payload *record);

/* False when the flash refused. */
bool store_erase(unsigned sensor);

#endif
