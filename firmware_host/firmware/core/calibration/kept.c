#include "kept.h"

#include <string.h>

#define BLOCKS 1024u
#define RATE_TOLERANCE 1.1f    /* a part's oscillator may run this much faster than its nominal rate */
#define SPARE_BLOCKS 2u        /* of each sensor: the block in progress, and the one after the span, which marks its end */

struct block {
    uint32_t first_us; /* low bits */
    int32_t sums[3];
};

static struct block blocks[BLOCKS];

static struct section {
    struct block *blocks;
    uint32_t capacity;  /* in readings; 0: not stored */
    uint32_t readings;
    uint64_t origin_us; /* time of the first reading */
} sections[SENSOR_COUNT];

static uint32_t per_block; /* readings */

bool kept_begin(const float rates_hz[SENSOR_COUNT], float duration_s)
{
    memset(sections, 0, sizeof sections);
    if (!(duration_s > 0.0f && duration_s <= KEPT_LONGEST_S))
        return false;
    float readings = 0.0f;
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        readings += rates_hz[i] * RATE_TOLERANCE * duration_s;
    per_block = 1u + (uint32_t)(readings / (BLOCKS - GYROSCOPE_COUNT * (SPARE_BLOCKS + 1u)));
    struct block *next = blocks;
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        if (!(rates_hz[i] > 0.0f))
            continue;
        uint32_t section_blocks = (uint32_t)(rates_hz[i] * RATE_TOLERANCE * duration_s) / per_block + 1u + SPARE_BLOCKS;
        sections[i] = (struct section){.blocks = next, .capacity = section_blocks * per_block};
        next += section_blocks;
    }
    return true;
}

void kept_forget(unsigned sensor)
{
    memset(&sections[sensor], 0, sizeof sections[sensor]);
}

void kept_add(unsigned sensor, uint64_t time_us, const int16_t counts[3])
{
    struct section *section = &sections[sensor];
    if (section->readings == section->capacity)
        return;
    struct block *block = &section->blocks[section->readings / per_block];
    if (section->readings == 0)
        section->origin_us = time_us;
    if (section->readings % per_block == 0)
        *block = (struct block){.first_us = (uint32_t)time_us};
    for (unsigned axis = 0; axis < 3; axis++)
        block->sums[axis] += counts[axis];
    section->readings++;
}

static uint64_t get_time(const struct section *section, uint32_t block)
{
    return section->origin_us + (section->blocks[block].first_us - (uint32_t)section->origin_us);
}

bool kept_sum(unsigned sensor, uint64_t start_us, uint64_t end_us, struct kept_span *span)
{
    const struct section *section = &sections[sensor];
    if (section->readings == 0)
        return false;
    uint32_t first = 0, after = (section->readings - 1) / per_block; /* the last block may be incomplete */
    if (get_time(section, first) > start_us || get_time(section, after) < end_us)
        return false;
    while (first < after && get_time(section, first) < start_us)
        first++;
    while (first < after && get_time(section, after) > end_us)
        after--;
    *span = (struct kept_span){get_time(section, first), get_time(section, after), (after - first) * per_block, {0}};
    for (uint32_t i = first; i < after; i++)
        for (unsigned axis = 0; axis < 3; axis++)
            span->sums[axis] += section->blocks[i].sums[axis];
    return first < after;
}
