#include "frame.h"

#define CRC_OF_INTACT 0x2144DF1Cu /* of any bytes followed by their own CRC */

uint32_t frame_crc(uint32_t crc, const uint8_t *bytes, size_t size)
{
    static const uint32_t of_nibble[16] = { /* polynomial 0x04C11DB7, bits reversed */
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    crc = ~crc;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        crc = crc >> 4 ^ of_nibble[crc & 0xFu];
        crc = crc >> 4 ^ of_nibble[crc & 0xFu];
    }
    return ~crc;
}

/* The one COBS block of a frame under construction: `code` points to the distance to the next zero. */
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
    uint32_t crc = frame_crc(frame_crc(0, head, sizeof head), frame->payload, frame->size);
    const uint8_t tail[4] = {(uint8_t)crc, (uint8_t)(crc >> 8), (uint8_t)(crc >> 16), (uint8_t)(crc >> 24)};

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
    if (length < FRAME_OVERHEAD || length > FRAME_MAX || frame_crc(0, block, length) != CRC_OF_INTACT)
        return false;
    frame->type = block[0];
    frame->sequence = block[1];
    frame->size = (uint8_t)(length - FRAME_OVERHEAD);
    frame->payload = block + 2;
    return true;
}
