/* What the core asks of a sensor's driver. */
#ifndef SENSOR_H
#define SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

/* One conversion, in the part's right-handed axes. */
struct reading {
    int16_t counts[3];       /* of the rate or the field */
    int16_t acceleration[3]; /* only where it was asked for */
    int16_t temperature_counts;
};

enum read_result {
    READ_FRESH,   /* a new conversion */
    READ_STALE,   /* nothing new, or nobody there */
    READ_DAMAGED, /* the part's own checksum does not match */
    READ_FAULTY,  /* the part itself says that something is wrong with it */
    READ_TORN,    /* the next conversion came in between: what was read is of two, and nobody is to blame */
};

struct sensor_driver {
    char part[12];
    uint16_t identity; /* what `identify` reads of this part */
    uint8_t quantity;  /* enum sensor_quantity */

    /* What to throw away after a configure, while the part starts up and its filters settle: for so long, and so many. */
    uint32_t settling_us;
    uint8_t settling;

    /* The data-ready line stays up until a reading lowers it; else it falls by itself. */
    bool holds_line;

    /* So long after a reading began at most, a new conversion may still be what is read. */
    uint8_t latched_within_us;

    /* Forgets what it remembers of the part; NULL when that is nothing. */
    void (*reset)(unsigned device);

    /* Lets the part, which has been identified, listen to nothing but its select: what is said to another one may look
       like its I2C address, and its answer would spoil what is said. NULL when it has no I2C. May come again and again. */
    void (*keep_to_spi)(unsigned device);

    /* Reads the identity register. */
    uint16_t (*identify)(unsigned device);

    /* Sets the part, which has been identified, to data rate and range, both positive, a gyroscope also to a range of
       accelerations, not negative, and reads every setting back; fills `setup` with what the part really does. 0, or why
       not. */
    enum error_code (*configure)(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup);

    /* Reads one conversion, of what `setup` has, which also lowers the data-ready line of a part that holds
       it; with its accelerations where `setup` has a range of those. */
    enum read_result (*read)(unsigned device, const struct setup_payload *setup, struct reading *reading);
};

#endif
