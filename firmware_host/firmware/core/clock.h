/* The port's wrapping 32-bit microsecond counter as 64-bit board time. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdint.h>

void clock_reset(void);

/* Returns the present board time, µs; every tick of the main loop calls it, as it must be called every 35 minutes. */
uint64_t clock_now(void);

/* Returns the board time of a counter value captured within 35 minutes of the last clock_now(), without reading the counter. */
uint64_t clock_at(uint32_t captured_us);

#endif
