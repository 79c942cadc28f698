/* The layouts of a stream's batches. */
#ifndef BATCH_H
#define BATCH_H

#include <stdint.h>

#include "correction.h"
#include "sensor.h"

struct sample {
    uint64_t time_us;
    uint32_t sequence;
    struct reading reading;
};

struct batch_layout {
    uint8_t message; /* which begins as struct samples_payload */
    uint8_t mode;
    uint8_t item_size;

    /* Writes one item. Only calibrated rates use the correction. */
    void (*write)(const struct sample *sample, uint32_t delta_us, struct correction *correction, uint8_t *item);
};

extern const struct batch_layout batch_samples, batch_imu_samples, batch_field_samples, batch_rates;

#endif
