/* The two common answers to requests. */
#ifndef REPLY_H
#define REPLY_H

#include "frame.h"

/* Acknowledges a request; `sequence` is the request's. */
void reply_done(uint8_t sequence);

void reply_refused(const struct frame *request, enum error_code code, uint8_t sensor);

#endif
