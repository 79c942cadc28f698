/* The board's behaviour: answers the host, streams samples. */
#ifndef BOARD_H
#define BOARD_H

#include "protocol.h"

void board_reset(void);

/* One pass of the main loop; call it after every interrupt and at least every 50 ms. */
void board_run(void);

/* What a sensor is set up to; its rate is 0 unless it is configured. */
const struct setup_payload *board_setup_of(unsigned sensor);

/* 0 when there is such a sensor and it is configured, or why not. */
enum error_code board_check_sensor(uint8_t sensor);

/* The same for every sensor with its bit in `sensors`; `*wrong` becomes the first that is not. */
enum error_code board_check_mask(uint8_t sensors, uint8_t *wrong);

#endif
