/* The heater on a pin of the board: on by the host's word alone, and off by itself. */
#ifndef HEATER_H
#define HEATER_H

#include "frame.h"

/* Off. */
void heater_reset(void);

void heater_on_heat(const struct frame *request);

/* Switches off what must not be on; in every pass of the main loop. */
void heater_run(void);

#endif
