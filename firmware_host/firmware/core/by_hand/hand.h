/* The board calibrates a gyroscope that a hand turns on a table: it finds the rests and the moves, and solves. */
#ifndef HAND_H
#define HAND_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"
#include "sensor.h"

void hand_reset(void);

/* A sensor is about to be set up: a session with it that goes on ends. What another has found stays until the next begins. */
void hand_forget(unsigned sensor);

/* Begins anew with a sensor that is set up; done after so many moves at least, when the scale is known so well. */
void hand_begin(uint8_t sensor, uint8_t moves, float scale_std);

/* Takes a good reading, which is the conversion of number `sequence`. */
void hand_add(unsigned sensor, uint64_t time_us, uint32_t sequence, const struct reading *reading);

/* Whether a lamp that tells how it goes is lit now. At rest it is on, and blinks slowly for a while when a move has been
   taken, fast when it is to be made again. Done, it flashes once a second. */
bool hand_lamp(uint64_t now_us);

void hand_on_begin(const struct frame *request);
void hand_on_status(const struct frame *request);
void hand_on_solve(const struct frame *request);

#endif
