/* The sensors' settings. */
#ifndef SETUPS_H
#define SETUPS_H

#include "protocol.h"

void setups_reset(void);

/* Identifies and configures an existing sensor; 0, or the reason why it is not configured. Nothing is written to another part.
   */
enum error_code setups_configure(const struct configure_payload *wanted);

/* Returns an existing sensor's settings; its rate is 0 unless it is configured. */
const struct setup_payload *setups_of(unsigned sensor);

/* Returns 0 if there is such a gyroscope and it is configured, or the reason why not. */
enum error_code setups_check(uint8_t sensor);

/* Returns the same for all sensors with their bit in `mask`; `*wrong` becomes the first that fails. */
enum error_code setups_check_mask(uint8_t mask, uint8_t *wrong);

#endif
