/* Initializes clock, pins and peripherals. */
#ifndef BOARD_SETUP_H
#define BOARD_SETUP_H

#include <stdbool.h>

#define CLOCK_HZ 80000000u /* of the core, the timers and both peripheral buses */

void setup_hardware(void);

/* Locks the clock to the 32768 Hz crystal once that runs, after up to two seconds; true from then on. */
bool setup_lock_clock(void);

#endif
