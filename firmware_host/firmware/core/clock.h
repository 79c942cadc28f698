/* The port's wrapping 32-bit microsecond counter as 64-bit board time. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdint.h>

void clock_reset(void);

/* Board time now, µs; to be called at least once in 35 minutes, which every tick of the main loop does. */
uint64_t clock_now(void);

/* Board time of a counter value captured within 35 minutes of the last clock_now(). Does not read the counter. */
uint64_t clock_at(uint32_t captured_us);

#endif
