/* The heater on a pin of the board: switched on by the host alone, and off by itself. */
#ifndef HEATER_H
#define HEATER_H

#include "frame.h"

/* Switches the heater off. */
void heater_reset(void);

void heater_on_heat(const struct frame *request);

/* Switches the heater off if it must not be on; called in every pass of the main loop. */
void heater_run(void);

#endif
