#include "link.h"

#include <string.h>

#include "port.h"

#define RX_RING 256u /* a power of two, larger than the host's data before an answer */
#define TX_BUFFER (2u * WIRE_MAX + 16u)

static struct {
    volatile uint8_t ring[RX_RING];
    volatile uint32_t written; /* written by the interrupt */
    uint32_t read;
    uint8_t block[WIRE_MAX];
    size_t filled;
    bool too_long;
    uint32_t errors;
} rx;

static struct {
    uint8_t buffer[2][TX_BUFFER]; /* one fills while the other is on the wire */
    size_t filled;
    unsigned filling;
    volatile bool busy;
    uint8_t sequence;
    uint32_t overruns;
} tx;

void link_reset(void)
{
    memset(&rx, 0, sizeof rx);
    memset(&tx, 0, sizeof tx);
}

void link_byte_received(uint8_t byte)
{
    rx.ring[rx.written % RX_RING] = byte;
    rx.written++;
}

void link_sent(void)
{
    tx.busy = false;
}

/* Adds one byte to the block; true when it ends a block that decodes. */
static bool take_byte(uint8_t byte, struct frame *frame)
{
    if (byte != 0) {
        if (rx.filled < sizeof rx.block)
            rx.block[rx.filled++] = byte;
        else
            rx.too_long = true;
        return false;
    }
    size_t size = rx.filled;
    bool too_long = rx.too_long;
    rx.filled = 0;
    rx.too_long = false;
    if (size == 0 && !too_long)
        return false; /* the host's greeting zero, or two delimiters in a row */
    if (!too_long && frame_decode(rx.block, size, frame))
        return true;
    rx.errors++;
    return false;
}

bool link_receive(struct frame *frame)
{
    if (rx.written - rx.read > RX_RING) { /* overrun: the rest is a mixture */
        rx.read = rx.written;
        rx.too_long = true;
    }
    while (rx.read != rx.written) {
        uint8_t byte = rx.ring[rx.read % RX_RING];
        rx.read++;
        if (take_byte(byte, frame))
            return true;
    }
    return false;
}

bool link_has_room(void)
{
    return tx.filled + WIRE_MAX <= TX_BUFFER;
}

bool link_send(enum message_type type, const void *payload, size_t size)
{
    if (!link_has_room()) {
        tx.overruns++;
        return false;
    }
    struct frame frame = {.type = (uint8_t)type, .sequence = tx.sequence++, .size = (uint8_t)size, .payload = payload};
    tx.filled += frame_encode(&frame, &tx.buffer[tx.filling][tx.filled]);
    return true;
}

void link_transmit(void)
{
    if (tx.busy || tx.filled == 0)
        return;
    tx.busy = true;
    port_transmit(tx.buffer[tx.filling], tx.filled);
    tx.filling ^= 1u;
    tx.filled = 0;
}

bool link_is_idle(void)
{
    return !tx.busy && tx.filled == 0;
}

uint32_t link_rx_errors(void)
{
    return rx.errors;
}

uint32_t link_tx_overruns(void)
{
    return tx.overruns;
}
