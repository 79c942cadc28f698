/* A stress test with damaged frames: `damaged_frames COUNT SEED FRAMES [VALID]`. FRAMES holds sound frames, delimiters
   included.

   The firmware's receiver must decode every block as a second receiver does, which is written bit by bit from the protocol's
   description alone; accepted blocks go to the board, which must answer or refuse them. With VALID the stream goes to stdout
   instead, for another receiver, and the blocks that the second receiver accepts go to that file. The counts go to stderr, as
   JSON. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "link.h"
#include "parts.h"
#include "port.h"

#define SOUND_MAX 4096u
#define BLOCK_MAX 4096u
#define BURST 200u /* bytes that arrive before the board processes them */

typedef void (*bus_function)(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);

/* Of port_host. */
void host_connect(bus_function bus, void (*transmit)(const uint8_t *, size_t), void (*restart)(void));
void host_set_time_us(uint32_t now_us);

struct block {
    uint8_t bytes[BLOCK_MAX];
    size_t size;
};

static struct block sound[SOUND_MAX], wire; /* without their delimiters; `wire`: bytes since the last zero */
static struct block made; /* the last damaged frame with a corrected CRC */
static size_t sound_count;
static FILE *valid; /* NULL: test of the firmware's receiver */

static struct {
    unsigned long frames, blocks, valid, as_sent, made, chance, refused, answers, errors;
} count;

static uint64_t state;

static size_t below(size_t limit)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return limit == 0 ? 0 : (size_t)(state >> 33) % limit;
}

static void must(bool condition)
{
    if (!condition)
        abort();
}

/* -- the second receiver ------------------------------------------------------------------------------------------------- */
static uint32_t crc_by_bits(const uint8_t *bytes, size_t size)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
    }
    return ~crc;
}

/* Writes type, sequence, payload and CRC into `body`; returns their size, 0 if it is no frame. */
static size_t body_of(const struct block *block, uint8_t body[BLOCK_MAX])
{
    size_t size = 0, left = 0; /* `left`: bytes to the next replaced zero */
    if (block->size < FRAME_OVERHEAD + 1 || block->size > FRAME_MAX + 1)
        return 0;
    for (size_t i = 0; i < block->size; i++) {
        if (left == 0) {
            if (i != 0)
                body[size++] = 0;
            left = block->bytes[i];
        } else {
            body[size++] = block->bytes[i];
        }
        left--;
    }
    if (left != 0)
        return 0;
    uint32_t crc = crc_by_bits(body, size - 4);
    for (unsigned i = 0; i < 4; i++)
        if (body[size - 4 + i] != (uint8_t)(crc >> 8 * i))
            return 0;
    return size;
}

/* -- damage --------------------------------------------------------------------------------------------------------------- */
static void put(struct block *block, const uint8_t *body, size_t size)
{
    size_t code = 0;
    block->size = 1;
    for (size_t i = 0; i < size; i++) {
        if (body[i] == 0) {
            block->bytes[code] = (uint8_t)(block->size - code);
            code = block->size++;
        } else {
            block->bytes[block->size++] = body[i];
        }
    }
    block->bytes[code] = (uint8_t)(block->size - code);
}

static bool same(const struct block *one, const struct block *other)
{
    return one->size == other->size && memcmp(one->bytes, other->bytes, one->size) == 0;
}

/* Replaces `gone` bytes at an offset by `size` bytes of `from`, or random ones. */
static void replace(struct block *block, size_t place, size_t gone, const uint8_t *from, size_t size)
{
    if (place + gone > block->size || block->size - gone + size > BLOCK_MAX)
        return;
    memmove(&block->bytes[place + size], &block->bytes[place + gone], block->size - place - gone);
    for (size_t i = 0; i < size; i++)
        block->bytes[place + i] = from != NULL ? from[i] : (uint8_t)below(256);
    block->size = block->size - gone + size;
}

static void nonsense(struct block *block, bool right_crc, bool right_length)
{
    uint8_t body[BLOCK_MAX];
    size_t size = body_of(block, body);
    must(size != 0);
    if (right_crc || !right_length) {
        size = right_length ? size : FRAME_OVERHEAD + below(FRAME_MAX - FRAME_OVERHEAD + 1);
        if (!right_length || below(2))
            body[0] = (uint8_t)below(below(2) ? 32 : 256);
        for (size_t i = 1; i < size - 4; i++)
            if (!right_length || below(2))
                body[i] = (uint8_t)below(256);
    }
    uint32_t crc = crc_by_bits(body, size - 4) ^ (right_crc ? 0u : 1u + (uint32_t)below(0x7FFFFFFF));
    for (unsigned i = 0; i < 4; i++)
        body[size - 4 + i] = (uint8_t)(crc >> 8 * i);
    put(block, body, size);
    if (right_crc)
        made = *block;
}

static void damage(struct block *block)
{
    const struct block *other = &sound[below(sound_count)];
    uint8_t run[BLOCK_MAX];
    size_t place = below(block->size), size = 1 + below(below(3) ? 4 : block->size);
    if (place + size > block->size)
        size = block->size - place;
    memcpy(run, &block->bytes[place], size);
    switch (below(13)) {
    case 0: /* bits */
        block->bytes[place] ^= (uint8_t)(1u << below(8));
        break;
    case 1:
        for (size_t bits = 2 + below(7); bits != 0; bits--)
            block->bytes[below(block->size)] ^= (uint8_t)(1u << below(8));
        break;
    case 2: /* the end is cut off */
        block->size = place;
        break;
    case 3: /* a run of bytes is lost, doubled, overwritten, inserted, or swapped with the one before */
        replace(block, place, size, NULL, 0);
        break;
    case 4:
        replace(block, place, 0, run, size);
        break;
    case 5:
        replace(block, place, size, NULL, size);
        break;
    case 6:
        replace(block, place, 0, NULL, size);
        break;
    case 7:
        replace(block, place, size, NULL, 0);
        replace(block, below(place + 1), 0, run, size);
        break;
    case 8: /* it continues as another frame */
        size = below(other->size);
        replace(block, place, block->size - place, &other->bytes[size], other->size - size);
        break;
    case 9: /* over-long */
        while (block->size < 260 + size)
            replace(block, block->size, 0, other->bytes, other->size);
        break;
    case 10:
        nonsense(block, false, true);
        break;
    case 11:
        nonsense(block, true, below(2));
        break;
    default: /* noise */
        block->size = below(300);
        replace(block, 0, block->size, NULL, block->size);
    }
}

/* -- the line ------------------------------------------------------------------------------------------------------------- */
static void transmit(const uint8_t *bytes, size_t size)
{
    struct block answer = {.size = 0};
    uint8_t body[BLOCK_MAX];
    for (size_t i = 0; i < size; i++) {
        if (bytes[i] != 0) {
            answer.bytes[answer.size++] = bytes[i];
            continue;
        }
        must(body_of(&answer, body) != 0);
        count.answers++;
        count.errors += body[0] == MESSAGE_ERROR;
        answer.size = 0;
    }
    must(answer.size == 0);
    link_sent();
}

static void restart(void)
{
    board_reset();
}

/* Compares both receivers at the end of a block. */
static void judge(void)
{
    uint8_t body[BLOCK_MAX];
    size_t size = body_of(&wire, body);
    struct frame frame;
    bool taken = valid == NULL && link_receive(&frame);
    count.blocks += wire.size != 0;
    if (size == 0) {
        count.refused += wire.size != 0;
        must(!taken);
        return;
    }
    count.valid++;
    bool as_sent = false; /* all blocks as one: delimiters are damaged too */
    for (size_t i = 0; i < sound_count && !as_sent; i++)
        as_sent = same(&wire, &sound[i]);
    count.as_sent += as_sent;
    count.made += !as_sent && same(&wire, &made);
    count.chance += !as_sent && !same(&wire, &made);
    if (valid != NULL) {
        must(fwrite(wire.bytes, 1, wire.size, valid) == wire.size && fputc(0, valid) == 0);
        return;
    }
    must(taken && frame.type == body[0] && frame.sequence == body[1] && frame.size == size - FRAME_OVERHEAD);
    must(memcmp(frame.payload, &body[2], frame.size) == 0);
    /* Repeats the block for the board, which reads the line itself. */
    for (size_t i = 0; i < wire.size; i++)
        link_byte_received(wire.bytes[i]);
    link_byte_received(0);
    host_set_time_us(port_time_us() + 100);
    board_run();
    must(!link_receive(&frame));
}

static void send_byte(uint8_t byte)
{
    static size_t waiting;
    if (valid != NULL)
        putchar(byte);
    else
        link_byte_received(byte);
    if (byte == 0) {
        judge();
        wire.size = waiting = 0;
        return;
    }
    if (wire.size < BLOCK_MAX)
        wire.bytes[wire.size++] = byte;
    if (valid == NULL && ++waiting == BURST) {
        struct frame frame;
        must(!link_receive(&frame)); /* no block has ended */
        waiting = 0;
    }
}

static void read_sound(const char *path)
{
    FILE *file = fopen(path, "rb");
    must(file != NULL);
    for (int byte; (byte = fgetc(file)) != EOF && sound_count < SOUND_MAX;) {
        struct block *block = &sound[sound_count];
        if (byte != 0)
            block->bytes[block->size++] = (uint8_t)byte;
        else if (block->size != 0)
            sound_count++;
    }
    fclose(file);
    must(sound_count != 0);
}

int main(int arguments, char **argument)
{
    if (arguments < 4)
        return 2;
    unsigned long frames = strtoul(argument[1], NULL, 10);
    state = strtoull(argument[2], NULL, 10);
    read_sound(argument[3]);
    if (arguments > 4)
        must((valid = fopen(argument[4], "wb")) != NULL);
    parts_reset();
    host_connect(parts_xfer, transmit, restart);
    host_set_time_us(0);
    board_reset();
    for (; count.frames < frames; count.frames++) {
        struct block bad = sound[below(sound_count)];
        damage(&bad);
        for (size_t i = 0; i < bad.size; i++)
            send_byte(bad.bytes[i]);
        if (below(16)) /* else its delimiter is lost as well */
            send_byte(0);
    }
    send_byte(0);
    if (valid != NULL)
        must(fclose(valid) == 0);
    fprintf(stderr,
            "{\"frames\": %lu, \"blocks\": %lu, \"refused\": %lu, \"valid\": %lu, \"as_sent\": %lu, \"made\": %lu, "
            "\"chance\": %lu, \"answers\": %lu, \"errors\": %lu}\n",
            count.frames, count.blocks, count.refused, count.valid, count.as_sent, count.made, count.chance, count.answers,
            count.errors);
    return 0;
}
