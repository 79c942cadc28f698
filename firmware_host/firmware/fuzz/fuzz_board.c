/* The complete core under a fuzzer. An input is a session: bytes and frames from the host, conversions, time, broken parts, a
   busy line, a failing flash. In addition to the sanitizers' checks, the board must send complete frames with consecutive
   sequence numbers and not change bytes during their transmission. */
#include <stdlib.h>
#include <string.h>

#include "acquisition.h"
#include "board.h"
#include "link.h"
#include "parts.h"
#include "port.h"
#include "sensors.h"

typedef void (*bus_function)(unsigned device, uint32_t max_hz, uint8_t *bytes, size_t size);
typedef bool (*flash_function)(unsigned page, size_t offset, const uint64_t *doubleword);

/* Of port_host. */
void host_connect(bus_function bus, void (*transmit)(const uint8_t *, size_t), void (*restart)(void));
void host_set_time_us(uint32_t now_us);
void host_flash_watch(flash_function watch);
void host_flash_clear(void);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static struct {
    const uint8_t *at, *end;
} play;

static struct {
    const uint8_t *bytes; /* NULL: the line is free */
    size_t size;
    uint8_t copy[1024];
    bool busy;     /* nothing is sent until the session releases the line */
    int sequence; /* of the next frame; -1: any */
} line;

static unsigned flash_operations_left;

static uint8_t next(void)
{
    return play.at < play.end ? *play.at++ : 0;
}

static void must(bool condition)
{
    if (!condition)
        abort();
}

static void check_frames(const uint8_t *bytes, size_t size)
{
    uint8_t block[WIRE_MAX];
    size_t filled = 0;
    for (size_t i = 0; i < size; i++) {
        if (bytes[i] != 0) {
            must(filled < sizeof block);
            block[filled++] = bytes[i];
            continue;
        }
        struct frame frame;
        must(frame_decode(block, filled, &frame));
        must(line.sequence < 0 || frame.sequence == line.sequence);
        line.sequence = (uint8_t)(frame.sequence + 1);
        filled = 0;
    }
    must(filled == 0);
}

static void sent(void)
{
    if (line.bytes == NULL)
        return;
    must(memcmp(line.copy, line.bytes, line.size) == 0);
    line.bytes = NULL;
    link_sent();
}

static void transmit(const uint8_t *bytes, size_t size)
{
    must(line.bytes == NULL && size <= sizeof line.copy);
    check_frames(bytes, size);
    memcpy(line.copy, bytes, size);
    line.bytes = bytes;
    line.size = size;
    if (!line.busy)
        sent();
}

static void restart(void)
{
    line.bytes = NULL;
    line.sequence = -1;
    board_reset();
}

static bool flash_works(unsigned page, size_t offset, const uint64_t *doubleword)
{
    (void)doubleword;
    must(page < FLASH_PAGES && offset < FLASH_PAGE_BYTES && offset % sizeof *doubleword == 0);
    if (flash_operations_left != 0)
        flash_operations_left--;
    return flash_operations_left != 0;
}

static void pass(unsigned duration_us)
{
    host_set_time_us(port_time_us() + duration_us);
    board_run();
}

static void receive(const uint8_t *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++)
        link_byte_received(bytes[i]);
}

static void receive_frame(void)
{
    uint8_t payload[PAYLOAD_MAX], wire[WIRE_MAX];
    struct frame frame = {.type = next(), .sequence = next(), .payload = payload};
    frame.size = next() % (PAYLOAD_MAX + 1u);
    for (unsigned i = 0; i < frame.size; i++)
        payload[i] = next();
    receive(wire, frame_encode(&frame, wire));
    pass(100);
}

static void receive_noise(void)
{
    uint8_t bytes[255];
    size_t size = next();
    for (size_t i = 0; i < size; i++)
        bytes[i] = next();
    receive(bytes, size);
    if (size != sizeof bytes) /* noise may overrun the ring before the board processes it */
        pass(100);
}

static void convert(void)
{
    uint8_t sensors_named = next(), value = next(), times = next();
    unsigned period_us = 50u * next();
    for (unsigned i = 0; i < times; i++) {
        pass(period_us);
        for (unsigned sensor = 0; sensor < SENSOR_COUNT; sensor++)
            if (is_named(sensors_named, sensor)) {
                parts_convert(sensor, (uint8_t)(value + i));
                acquisition_data_ready(sensor, port_time_us());
            }
    }
    pass(10);
}

static void act(void)
{
    switch (next() % 7) {
    case 0:
        receive_noise();
        break;
    case 1:
        receive_frame();
        break;
    case 2:
        convert();
        break;
    case 3:
        pass(1000u * next() * next());
        break;
    case 4: {
        unsigned part = next() % SENSOR_COUNT;
        uint8_t address = next();
        parts_disturb(part, address, next());
        break;
    }
    case 5:
        line.busy = next() & 1;
        if (!line.busy)
            sent();
        pass(10);
        break;
    case 6:
        flash_operations_left = next();
        host_flash_watch(flash_works);
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    play.at = data;
    play.end = data + size;
    memset(&line, 0, sizeof line);
    line.sequence = -1;
    parts_reset();
    host_flash_clear();
    host_connect(parts_xfer, transmit, restart);
    host_set_time_us(0);
    board_reset();
    while (play.at < play.end)
        act();
    return 0;
}
