/* The two answers that every request may get. */
#ifndef REPLY_H
#define REPLY_H

#include "frame.h"

/* Done as asked; `sequence` is the request's. */
void reply_done(uint8_t sequence);

void reply_refused(const struct frame *request, enum error_code code, uint8_t sensor);

#endif
