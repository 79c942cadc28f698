#include "store.h"

#include <string.h>

#include "frame.h"
#include "port.h"
#include "sensors.h"

/* Each sensor has two pages, slots, and a write goes to the slot without the newest record, which stays unchanged until the new
   one is complete. The seal comes last and marks a complete record; its CRC also detects a page with an interrupted erasure
   that still looks like a record. */

#define SLOTS 2u
#define SEAL 0x334C4143u          /* "CAL3": another layout has another number, so that an older image finds no record */
#define CONSTANT_SEAL 0x324C4143u /* "CAL2", up to firmware 0.8.0: it ends before the polynomials of temperature */
#define DIAGONAL_SEAL 0x314C4143u /* "CAL1", up to firmware 0.2.1: and has three scale factors instead of the matrix */

struct slot {
    struct calibration_payload record;
    uint8_t unused[3]; /* up to whole doublewords */
    uint32_t seal;
    uint32_t crc; /* of all bytes before the seal */
};

#define DOUBLEWORDS (sizeof(struct slot) / sizeof(uint64_t))

struct constant_slot {
    uint8_t record[offsetof(struct calibration_payload, lowest_c)];
    uint8_t unused[3];
    uint32_t seal;
    uint32_t crc;
} __attribute__((packed));

struct diagonal_slot {
    uint8_t head[offsetof(struct calibration_payload, matrix)];
    float scale[3];
    float bias_rad_s[3];
    uint8_t unused[3];
    uint32_t seal;
    uint32_t crc;
} __attribute__((packed));

_Static_assert(sizeof(struct calibration_payload) == 189, "another layout takes another seal");
_Static_assert(sizeof(struct constant_slot) == 120, "as it lies in flash");
_Static_assert(sizeof(struct diagonal_slot) == 96, "as it lies in flash");
_Static_assert(sizeof(struct slot) % sizeof(uint64_t) == 0 && offsetof(struct slot, seal) % sizeof(uint64_t) == 0,
               "the seal is the last doubleword");
_Static_assert(SLOTS * GYROSCOPE_COUNT <= FLASH_PAGES && sizeof(struct slot) <= FLASH_PAGE_BYTES, "the flash has room");

static unsigned get_page(unsigned sensor, unsigned slot)
{
    return SLOTS * sensor + slot;
}

/* Checks a slot of any layout, which ends with its seal and the CRC of all bytes before. */
static bool read_sealed(unsigned page, void *slot, size_t size, uint32_t seal)
{
    uint32_t end[2];
    if (!port_flash_read(page, 0, slot, size))
        return false;
    memcpy(end, (uint8_t *)slot + size - sizeof end, sizeof end);
    return end[0] == seal && end[1] == frame_crc(0, slot, size - sizeof end);
}

static bool read_diagonal(unsigned page, struct calibration_payload *record)
{
    struct diagonal_slot slot;
    if (!read_sealed(page, &slot, sizeof slot, DIAGONAL_SEAL))
        return false;
    *record = (struct calibration_payload){0};
    memcpy(record, slot.head, sizeof slot.head);
    memcpy(record->bias_rad_s, slot.bias_rad_s, sizeof record->bias_rad_s);
    for (unsigned axis = 0; axis < 3; axis++)
        record->matrix[axis][axis] = slot.scale[axis];
    return true;
}

static bool read_constant(unsigned page, struct calibration_payload *record)
{
    struct constant_slot slot;
    if (!read_sealed(page, &slot, sizeof slot, CONSTANT_SEAL))
        return false;
    *record = (struct calibration_payload){0};
    memcpy(record, slot.record, sizeof slot.record);
    return true;
}

/* Converts a record of an older layout, without polynomials. */
static bool read_older(unsigned page, struct calibration_payload *record)
{
    if (!read_constant(page, record) && !read_diagonal(page, record))
        return false;
    record->lowest_c = record->highest_c = record->temperature_c;
    return true;
}

static bool read_record(unsigned page, struct calibration_payload *record)
{
    struct slot slot;
    if (!read_sealed(page, &slot, sizeof slot, SEAL))
        return read_older(page, record);
    *record = slot.record;
    return true;
}

/* Compares sequence numbers by their difference, because they may wrap. */
static bool is_newer(const struct calibration_payload *a, const struct calibration_payload *b)
{
    return (int32_t)(a->sequence - b->sequence) > 0;
}

/* Returns the slot of the newest record and reads that into `newest`; SLOTS if there is none. */
static unsigned find_newest(unsigned sensor, struct calibration_payload *newest)
{
    struct calibration_payload record;
    unsigned found = SLOTS;
    for (unsigned i = 0; i < SLOTS; i++)
        if (read_record(get_page(sensor, i), &record) && (found == SLOTS || is_newer(&record, newest))) {
            *newest = record;
            found = i;
        }
    return found;
}

bool store_read(unsigned sensor, struct calibration_payload *record)
{
    return find_newest(sensor, record) != SLOTS;
}

static bool program(unsigned page, const struct slot *slot)
{
    for (unsigned i = 0; i < DOUBLEWORDS; i++) {
        uint64_t doubleword;
        memcpy(&doubleword, (const uint8_t *)slot + i * sizeof doubleword, sizeof doubleword);
        if (!port_flash_program(page, i * sizeof doubleword, doubleword))
            return false;
    }
    return true;
}

bool store_write(unsigned sensor, struct calibration_payload *record)
{
    struct calibration_payload newest;
    struct slot written, slot = {.seal = SEAL};
    unsigned found = find_newest(sensor, &newest);
    unsigned page = get_page(sensor, found == 0 ? 1 : 0);
    record->sequence = found == SLOTS ? 1 : newest.sequence + 1;
    slot.record = *record;
    slot.crc = frame_crc(0, (const uint8_t *)&slot, offsetof(struct slot, seal));
    bool stored = port_flash_erase(page) && program(page, &slot) && read_sealed(page, &written, sizeof written, SEAL) &&
                  memcmp(&written, &slot, sizeof slot) == 0;
    /* An older image would apply the previous calibration, whose layout it can read. */
    if (stored && found != SLOTS && read_older(get_page(sensor, found), &newest))
        port_flash_erase(get_page(sensor, found));
    return stored;
}

/* The older record first: were it last, a power loss in between would bring it back. */
bool store_erase(unsigned sensor)
{
    struct calibration_payload newest;
    unsigned newer = find_newest(sensor, &newest) == 1 ? 1 : 0;
    return port_flash_erase(get_page(sensor, 1 - newer)) && port_flash_erase(get_page(sensor, newer));
}
