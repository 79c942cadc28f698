#include "kept.h"

#include <string.h>

#define BLOCKS 1024u
#define RATE_TOLERANCE 1.1f    /* a part's oscillator may run this much faster than its nominal rate */
#define BLOCKS_TO_SPARE 2u     /* of each sensor: the block in progress, and the one after the span, which marks its end */

struct block {
    uint32_t first_us; /* low bits */
    int32_t sums[3];
};

static struct block blocks[BLOCKS];

static struct share {
    struct block *blocks;
    uint32_t room;      /* in readings; 0: not stored */
    uint32_t readings;
    uint64_t origin_us; /* time of the first reading */
} shares[SENSOR_COUNT];

static uint32_t per_block; /* readings */

bool kept_begin(const float rates_hz[SENSOR_COUNT], float duration_s)
{
    memset(shares, 0, sizeof shares);
    if (!(duration_s > 0.0f && duration_s <= KEPT_LONGEST_S))
        return false;
    float readings = 0.0f;
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        readings += rates_hz[i] * RATE_TOLERANCE * duration_s;
    per_block = 1u + (uint32_t)(readings / (BLOCKS - GYROSCOPE_COUNT * (BLOCKS_TO_SPARE + 1u)));
    struct block *next = blocks;
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        if (!(rates_hz[i] > 0.0f))
            continue;
        uint32_t share = (uint32_t)(rates_hz[i] * RATE_TOLERANCE * duration_s) / per_block + 1u + BLOCKS_TO_SPARE;
        shares[i] = (struct share){.blocks = next, .room = share * per_block};
        next += share;
    }
    return true;
}

void kept_forget(unsigned sensor)
{
    memset(&shares[sensor], 0, sizeof shares[sensor]);
}

void kept_add(unsigned sensor, uint64_t time_us, const int16_t counts[3])
{
    struct share *share = &shares[sensor];
    if (share->readings == share->room)
        return;
    struct block *block = &share->blocks[share->readings / per_block];
    if (share->readings == 0)
        share->origin_us = time_us;
    if (share->readings % per_block == 0)
        *block = (struct block){.first_us = (uint32_t)time_us};
    for (unsigned axis = 0; axis < 3; axis++)
        block->sums[axis] += counts[axis];
    share->readings++;
}

static uint64_t time_of(const struct share *share, uint32_t block)
{
    return share->origin_us + (share->blocks[block].first_us - (uint32_t)share->origin_us);
}

bool kept_sum(unsigned sensor, uint64_t start_us, uint64_t end_us, struct kept_span *span)
{
    const struct share *share = &shares[sensor];
    if (share->readings == 0)
        return false;
    uint32_t first = 0, after = (share->readings - 1) / per_block; /* the last block may be incomplete */
    if (time_of(share, first) > start_us || time_of(share, after) < end_us)
        return false;
    while (first < after && time_of(share, first) < start_us)
        first++;
    while (first < after && time_of(share, after) > end_us)
        after--;
    *span = (struct kept_span){time_of(share, first), time_of(share, after), (after - first) * per_block, {0}};
    for (uint32_t i = first; i < after; i++)
        for (unsigned axis = 0; axis < 3; axis++)
            span->sums[axis] += share->blocks[i].sums[axis];
    return first < after;
}
