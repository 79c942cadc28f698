/* COBS frames with a CRC, as firmware_host/protocol.py describes them. */
#ifndef FRAME_H
#define FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol.h"

#define FRAME_MAX (PAYLOAD_MAX + FRAME_OVERHEAD) /* before COBS */
#define WIRE_MAX (FRAME_MAX + COBS_BYTES)

_Static_assert(FRAME_MAX < 254u, "a frame must fit one COBS block");

struct frame {
    uint8_t type;
    uint8_t sequence;
    uint8_t size; /* of the payload */
    const uint8_t *payload;
};

/* Returns zlib's CRC-32 of `size` bytes, continued from `crc`; start with 0. */
uint32_t frame_crc(uint32_t crc, const uint8_t *bytes, size_t size);

/* Writes the frame, delimiter included, to `wire` (WIRE_MAX bytes); returns its length. */
size_t frame_encode(const struct frame *frame, uint8_t *wire);

/* Undoes COBS in place on a block without its delimiter; false when the block is damaged. The frame's payload points into `block`. */
bool frame_decode(uint8_t *block, size_t size, struct frame *frame);

#endif
