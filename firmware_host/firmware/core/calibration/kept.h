/* Stores the readings of a sweep, until the host knows the interval of the revolution.

   There is not room for every reading, so a block is the sum of several in a row and the time of the first. */
#ifndef KEPT_H
#define KEPT_H

#include <stdbool.h>
#include <stdint.h>

#include "sensors.h"

/* Discards stored readings, and stores those of the sensors whose data rate is not 0, for at least the duration. False, without
   storing, if the duration is not positive or longer than KEPT_LONGEST_S. */
#define KEPT_LONGEST_S 1800.0f
bool kept_begin(const float rates_hz[SENSOR_COUNT], float duration_s);

void kept_forget(unsigned sensor);

void kept_add(unsigned sensor, uint64_t time_us, const int16_t counts[3]);

struct kept_span {
    uint64_t start_us; /* of the first reading in it */
    uint64_t end_us;   /* of the first reading after it */
    uint32_t samples;
    int64_t sums[3];
};

/* Sums the complete blocks between two board times; false unless all of that time was stored and contains a block. */
bool kept_sum(unsigned sensor, uint64_t start_us, uint64_t end_us, struct kept_span *span);

#endif
