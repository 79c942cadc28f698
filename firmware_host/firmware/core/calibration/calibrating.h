/* Calibration by the board itself: requests keep, observe, recall and solve. */
#ifndef CALIBRATING_H
#define CALIBRATING_H

#include "frame.h"

void calibrating_reset(void);

/* Discards stored readings and observations of a sensor that is about to be configured. */
void calibrating_forget(unsigned sensor);

void calibrating_on_keep(const struct frame *request);
void calibrating_on_observe(const struct frame *request);
void calibrating_on_recall(const struct frame *request);
void calibrating_on_solve(const struct frame *request);

#endif
