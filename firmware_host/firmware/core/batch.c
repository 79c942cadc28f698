#include "batch.h"

#include <string.h>

_Static_assert(sizeof(struct samples_payload) == sizeof(struct imu_samples_payload), "all batches begin alike");
_Static_assert(sizeof(struct samples_payload) == sizeof(struct field_samples_payload), "all batches begin alike");
_Static_assert(sizeof(struct samples_payload) == sizeof(struct rates_payload), "all batches begin alike");

static void write_samples(const struct sample *sample, uint32_t delta_us, struct correction *none, uint8_t *bytes)
{
    const struct reading *reading = &sample->reading;
    struct samples_item item = {.delta_us = delta_us, .temperature_counts = reading->temperature_counts};
    (void)none;
    memcpy(item.counts, reading->counts, sizeof item.counts);
    memcpy(bytes, &item, sizeof item);
}

static void write_imu_samples(const struct sample *sample, uint32_t delta_us, struct correction *none, uint8_t *bytes)
{
    const struct reading *reading = &sample->reading;
    struct imu_samples_item item = {.delta_us = delta_us, .temperature_counts = reading->temperature_counts};
    (void)none;
    memcpy(item.counts, reading->counts, sizeof item.counts);
    memcpy(item.acceleration, reading->acceleration, sizeof item.acceleration);
    memcpy(bytes, &item, sizeof item);
}

static void write_field_samples(const struct sample *sample, uint32_t delta_us, struct correction *none, uint8_t *bytes)
{
    struct field_samples_item item = {.delta_us = delta_us};
    (void)none;
    memcpy(item.field, sample->reading.counts, sizeof item.field);
    memcpy(bytes, &item, sizeof item);
}

static void write_rates(const struct sample *sample, uint32_t delta_us, struct correction *correction, uint8_t *bytes)
{
    const struct reading *reading = &sample->reading;
    struct rates_item item = {.delta_us = delta_us, .temperature_counts = reading->temperature_counts};
    int32_t rate_urad_s[3];
    correction_apply(correction, reading, rate_urad_s);
    memcpy(item.rate_urad_s, rate_urad_s, sizeof item.rate_urad_s);
    memcpy(bytes, &item, sizeof item);
}

const struct batch_layout batch_samples = {MESSAGE_SAMPLES, MODE_RAW, sizeof(struct samples_item), write_samples};
const struct batch_layout batch_imu_samples = {
    MESSAGE_IMU_SAMPLES, MODE_RAW, sizeof(struct imu_samples_item), write_imu_samples};
const struct batch_layout batch_field_samples = {
    MESSAGE_FIELD_SAMPLES, MODE_RAW, sizeof(struct field_samples_item), write_field_samples};
const struct batch_layout batch_rates = {MESSAGE_RATES, MODE_CALIBRATED, sizeof(struct rates_item), write_rates};
