/* The parts on the bus as memories that answer the drivers, and that the fuzzer may disturb. */
#ifndef PARTS_H
#define PARTS_H

#include <stddef.h>
#include <stdint.h>

/* Sets all parts to their state after power-up. */
void parts_reset(void);

/* Carries out one exchange under chip select; answers in place. */
void parts_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);

/* Makes a new conversion of a part, with outputs derived from `value`. */
void parts_convert(unsigned device, uint8_t value);

/* Overwrites any byte of a part's memory. */
void parts_disturb(unsigned device, uint8_t address, uint8_t value);

#endif
