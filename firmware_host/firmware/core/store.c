#include "store.h"

#include <string.h>

#include "frame.h"
#include "port.h"
#include "sensors.h"

/* Each sensor has two pages, slots, and a write goes to the slot that does not hold the newest record: that one stays
   untouched until the new one is whole. The seal comes last and says that everything before it is there; its CRC also finds
   a page whose erasing was cut off and that still looks like a record. */

#define SLOTS 2u
#define SEAL 0x314C4143u /* "CAL1": another layout takes another number, and its records are then none */

struct slot {
    struct calibration_payload record;
    uint8_t unused[3]; /* up to whole doublewords */
    uint32_t seal;
    uint32_t crc; /* of all before the seal */
};

#define DOUBLEWORDS (sizeof(struct slot) / sizeof(uint64_t))

_Static_assert(sizeof(struct calibration_payload) == 85, "another layout takes another seal");
_Static_assert(sizeof(struct slot) % sizeof(uint64_t) == 0 && offsetof(struct slot, seal) % sizeof(uint64_t) == 0,
               "the seal is the last doubleword");
_Static_assert(SLOTS * SENSOR_COUNT <= FLASH_PAGES && sizeof(struct slot) <= FLASH_PAGE_BYTES, "the flash has room");

static unsigned page_of(unsigned sensor, unsigned slot)
{
    return SLOTS * sensor + slot;
}

static uint32_t crc_of(const struct slot *slot)
{
    return frame_crc(0, (const uint8_t *)slot, offsetof(struct slot, seal));
}

static bool read_slot(unsigned page, struct slot *slot)
{
    return port_flash_read(page, 0, slot, sizeof *slot) && slot->seal == SEAL && slot->crc == crc_of(slot);
}

/* Sequence numbers may wrap: the difference tells. */
static bool is_newer(const struct slot *a, const struct slot *b)
{
    return (int32_t)(a->record.sequence - b->record.sequence) > 0;
}

/* The slot of the newest record, which is then in `newest`; SLOTS when there is none. */
static unsigned find_newest(unsigned sensor, struct slot *newest)
{
    struct slot slots[SLOTS];
    unsigned found = SLOTS;
    for (unsigned i = 0; i < SLOTS; i++)
        if (read_slot(page_of(sensor, i), &slots[i]) && (found == SLOTS || is_newer(&slots[i], &slots[found])))
            found = i;
    if (found != SLOTS)
        *newest = slots[found];
    return found;
}

bool store_read(unsigned sensor, struct calibration_payload *record)
{
    struct slot newest;
    if (find_newest(sensor, &newest) == SLOTS)
        return false;
    *record = newest.record;
    return true;
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
    struct slot newest, written, slot = {.seal = SEAL};
    unsigned found = find_newest(sensor, &newest);
    unsigned page = page_of(sensor, found == 0 ? 1 : 0);
    record->sequence = found == SLOTS ? 1 : newest.record.sequence + 1;
    slot.record = *record;
    slot.crc = crc_of(&slot);
    return port_flash_erase(page) && program(page, &slot) && read_slot(page, &written) &&
           memcmp(&written, &slot, sizeof slot) == 0;
}

/* The older record first: were it last, a power loss in between would bring it back. */
bool store_erase(unsigned sensor)
{
    struct slot newest;
    unsigned newer = find_newest(sensor, &newest) == 1 ? 1 : 0;
    return port_flash_erase(page_of(sensor, 1 - newer)) && port_flash_erase(page_of(sensor, newer));
}
