/* What the sensors are set up to. */
#ifndef SETUPS_H
#define SETUPS_H

#include "protocol.h"

void setups_reset(void);

/* Identifies an existing sensor and sets it up; 0, or why it is now not configured. Nothing is written to another part. */
enum error_code setups_configure(const struct configure_payload *wanted);

/* What an existing sensor does; its rate is 0 unless it is configured. */
const struct setup_payload *setups_of(unsigned sensor);

/* 0 when there is such a gyroscope and it is configured, or why not. */
enum error_code setups_check(uint8_t sensor);

/* The same for every sensor with its bit in `mask`; `*wrong` becomes the first that is not. */
enum error_code setups_check_mask(uint8_t mask, uint8_t *wrong);

#endif
