/* What the core asks of a sensor's driver. */
#ifndef SENSOR_H
#define SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

struct reading {
    int16_t counts[3];
    int16_t temperature_counts;
};

enum read_result {
    READ_FRESH,   /* a new conversion */
    READ_STALE,   /* nothing new, or nobody there */
    READ_DAMAGED, /* the part's own checksum does not match */
    READ_FAULTY,  /* the part itself says that something is wrong with it */
};

struct sensor_driver {
    char part[12];

    /* What to throw away after a configure, while the part starts up and its filters settle: for so long, and so many. */
    uint32_t settling_us;
    uint8_t settling;

    /* Reads the identity register; true when it is this part's. */
    bool (*identify)(unsigned device, uint16_t *who_am_i);

    /* Sets rate and range, reads every setting back; fills `setup` with what the part really does. 0, or why not. */
    uint8_t (*configure)(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup);

    /* Reads one conversion, which also lowers the data-ready line of a part that holds it. */
    enum read_result (*read)(unsigned device, struct reading *reading);
};

/* The board's sensors: which driver, and which device of the port's bus. Data-ready lines are numbered alike. */
struct sensor {
    const struct sensor_driver *driver;
    unsigned device;
};

#define SENSOR_COUNT 3u
extern const struct sensor sensors[SENSOR_COUNT];

/* Whether a message's bit mask names the sensor. */
static inline bool is_named(uint8_t mask, unsigned sensor)
{
    return (mask >> sensor & 1) != 0;
}

#endif
