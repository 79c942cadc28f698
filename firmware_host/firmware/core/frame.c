#include "frame.h"

/* Shift-and-xor form of polynomial 0x1021: eight operations a byte and no table in flash. */
static uint16_t crc_byte(uint16_t crc, uint8_t byte)
{
    crc = (uint16_t)((crc >> 8) | (crc << 8));
    crc ^= byte;
    crc ^= (uint16_t)((crc & 0xFFu) >> 4);
    crc ^= (uint16_t)(crc << 12);
    crc ^= (uint16_t)((crc & 0xFFu) << 5);
    return crc;
}

uint16_t frame_crc(uint16_t crc, const uint8_t *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++)
        crc = crc_byte(crc, bytes[i]);
    return crc;
}

/* The one COBS block of a frame as it grows: `code` is where the distance to the next zero goes. */
struct stuffer {
    uint8_t *wire;
    size_t code;
    size_t end;
};

static void stuff(struct stuffer *out, const uint8_t *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        if (bytes[i] != 0) {
            out->wire[out->end++] = bytes[i];
        } else {
            out->wire[out->code] = (uint8_t)(out->end - out->code);
            out->code = out->end++;
        }
    }
}

size_t frame_encode(const struct frame *frame, uint8_t *wire)
{
    const uint8_t head[2] = {frame->type, frame->sequence};
    uint16_t crc = frame_crc(frame_crc(0, head, sizeof head), frame->payload, frame->size);
    const uint8_t tail[2] = {(uint8_t)(crc >> 8), (uint8_t)crc};

    struct stuffer out = {.wire = wire, .code = 0, .end = 1};
    stuff(&out, head, sizeof head);
    stuff(&out, frame->payload, frame->size);
    stuff(&out, tail, sizeof tail);
    wire[out.code] = (uint8_t)(out.end - out.code);
    wire[out.end++] = 0;
    return out.end;
}

/* Returns the decoded length, 0 when a code byte points outside the block. Decoding shrinks, so it can work in place. */
static size_t unstuff(uint8_t *block, size_t size)
{
    size_t in = 0, out = 0;
    while (in < size) {
        size_t next = in + block[in];
        if (block[in] == 0 || next > size)
            return 0;
        for (in++; in < next; in++)
            block[out++] = block[in];
        if (in < size)
            block[out++] = 0;
    }
    return out;
}

bool frame_decode(uint8_t *block, size_t size, struct frame *frame)
{
    size_t length = unstuff(block, size);
    if (length < FRAME_OVERHEAD || length > FRAME_MAX || frame_crc(0, block, length) != 0)
        return false;
    frame->type = block[0];
    frame->sequence = block[1];
    frame->size = (uint8_t)(length - FRAME_OVERHEAD);
    frame->payload = block + 2;
    return true;
}
