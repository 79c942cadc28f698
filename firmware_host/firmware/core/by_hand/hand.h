/* The board calibrates a gyroscope that a hand turns on a table: it finds the rests and the moves, and solves. */
#ifndef HAND_H
#define HAND_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"
#include "sensor.h"

void hand_reset(void);

/* Ends the session of a sensor that is about to be configured. The result of another sensor remains until the next session. */
void hand_forget(unsigned sensor);

/* Begins a session with a configured sensor; done after at least so many moves, at this standard uncertainty of the scale. */
void hand_begin(uint8_t sensor, uint8_t moves, float scale_std);

/* Adds a good reading, the conversion of number `sequence`. */
void hand_add(unsigned sensor, uint64_t time_us, uint32_t sequence, const struct reading *reading);

/* Returns whether the status lamp is lit now. At rest it is on, and blinks slowly after an accepted move, fast after one to
   repeat. When done, it flashes once a second. */
bool hand_lamp(uint64_t now_us);

void hand_on_begin(const struct frame *request);
void hand_on_status(const struct frame *request);
void hand_on_solve(const struct frame *request);

#endif
