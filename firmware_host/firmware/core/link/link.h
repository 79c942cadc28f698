/* Frames in and out of the serial port: a ring filled by the receive interrupt, two buffers emptied by the transmitter. */
#ifndef LINK_H
#define LINK_H

#include "frame.h"

void link_reset(void);

/* Called from interrupts. */
void link_byte_received(uint8_t byte);
void link_sent(void);

/* Takes the next complete frame; it stays valid until the next call. */
bool link_receive(struct frame *frame);

/* Queues a frame; false, counted as an overrun, if there is no room. */
bool link_send(enum message_type type, const void *payload, size_t size);
bool link_has_room(void);

/* Hands queued frames to the transmitter when it is free. */
void link_transmit(void);
bool link_is_idle(void);

uint32_t link_rx_errors(void);
uint32_t link_tx_overruns(void);

#endif
