/* The interface of a sensor's driver. */
#ifndef SENSOR_H
#define SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

/* One conversion, in the part's right-handed axes. */
struct reading {
    int16_t counts[3];       /* of the rate or the field */
    int16_t acceleration[3]; /* only if requested */
    int16_t temperature_counts;
};

enum read_result {
    READ_FRESH,   /* a new conversion */
    READ_STALE,   /* no new data, or no part */
    READ_DAMAGED, /* the part's own checksum does not match */
    READ_FAULTY,  /* the part reports a fault of its own */
    READ_TORN,    /* a mixture of two conversions, without a fault */
};

struct sensor_driver {
    char part[12];
    uint16_t identity; /* the identity of this part */
    uint8_t quantity;  /* enum sensor_quantity */

    /* Readings to discard after a configure, while the part starts up and its filters settle: a time, and a number. */
    uint32_t settling_us;
    uint8_t settling;

    /* Whether the data-ready line stays high until a read; else it is pulsed. */
    bool holds_line;

    /* The time after the start of a read within which a new conversion may still be latched. */
    uint8_t latched_within_us;

    /* Clears its state of the part; NULL if it has none. */
    void (*reset)(unsigned device);

    /* Makes the identified part ignore all but its select: traffic to another part may look like its I2C address, and its
       answer would corrupt that. NULL if it has no I2C. May be called repeatedly. */
    void (*keep_to_spi)(unsigned device);

    /* Reads the identity register. */
    uint16_t (*identify)(unsigned device);

    /* Sets the identified part to data rate and range, both positive, a gyroscope also to a range of accelerations, not
       negative, and reads every setting back; fills `setup` with the actual settings. 0, or the reason for a failure. */
    enum error_code (*configure)(unsigned device, const struct configure_payload *wanted, struct setup_payload *setup);

    /* Reads one conversion of the quantities in `setup`, with accelerations if it has a range of those. This also lowers a
       data-ready line with a level. */
    enum read_result (*read)(unsigned device, const struct setup_payload *setup, struct reading *reading);
};

#endif
