/* The parts on the bus, as far as the drivers look: memories that answer, and that the fuzzer may disturb. */
#ifndef PARTS_H
#define PARTS_H

#include <stddef.h>
#include <stdint.h>

/* All as after power-up. */
void parts_reset(void);

/* One chip select; answers in place. */
void parts_xfer(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);

/* A new conversion of a part, what it measures derived from `value`. */
void parts_convert(unsigned device, uint8_t value);

/* Overwrites any byte of a part's memory. */
void parts_disturb(unsigned device, uint8_t address, uint8_t value);

#endif
