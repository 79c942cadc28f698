#include "correction.h"

#include <string.h>

#include "protocol.h"

#define LARGEST 2147483520.0f /* the largest float below 2³¹ */

static float evaluate_polynomial(const float change[3][3], unsigned axis, float change_k)
{
    return change_k * (change[0][axis] + change_k * (change[1][axis] + change_k * change[2][axis]));
}

static void update_correction(struct correction *correction, float change_k)
{
    correction->change_k = change_k;
    for (unsigned axis = 0; axis < 3; axis++) {
        float factor = 1.0f + evaluate_polynomial(correction->scale_change, axis, change_k);
        for (unsigned row = 0; row < 3; row++)
            correction->present_gain_urad_s[row][axis] = correction->gain_urad_s[row][axis] * factor;
        correction->present_offset_counts[axis] =
            correction->offset_counts[axis] + evaluate_polynomial(correction->offset_change_counts, axis, change_k);
    }
}

struct correction correction_of(const struct calibration_payload *record, const struct setup_payload *setup)
{
    float matrix[3][3], bias_rad_s[3], bias_change_rad_s[3][3];
    struct correction correction = {
        .kelvin_per_count = (float)setup->temperature_scale_c,
        .kelvin_at_zero = (float)setup->temperature_offset_c - record->temperature_c,
    };
    float sensitivity_rad_s = (float)setup->sensitivity_rad_s;
    memcpy(matrix, record->matrix, sizeof matrix);
    memcpy(bias_rad_s, record->bias_rad_s, sizeof bias_rad_s);
    memcpy(correction.scale_change, record->scale_change, sizeof correction.scale_change);
    memcpy(bias_change_rad_s, record->bias_change_rad_s, sizeof bias_change_rad_s);
    if (record->lowest_c < record->highest_c) {
        correction.least_k = record->lowest_c - record->temperature_c;
        correction.most_k = record->highest_c - record->temperature_c;
    }
    for (unsigned row = 0; row < 3; row++) {
        correction.offset_counts[row] = bias_rad_s[row] / sensitivity_rad_s;
        for (unsigned axis = 0; axis < 3; axis++) {
            correction.gain_urad_s[row][axis] = matrix[row][axis] * sensitivity_rad_s * CALIBRATED_PER_RAD_S;
            correction.offset_change_counts[row][axis] = bias_change_rad_s[row][axis] / sensitivity_rad_s;
        }
    }
    update_correction(&correction, 0.0f);
    return correction;
}

static int32_t round_to_int32(float value)
{
    if (value >= LARGEST)
        return INT32_MAX;
    if (value <= -LARGEST)
        return -INT32_MAX;
    return (int32_t)(value < 0.0f ? value - 0.5f : value + 0.5f);
}

/* Returns the difference from the temperature of matrix and bias, limited to the polynomials' range. */
static float limit_temperature_change(const struct correction *correction, int16_t temperature_counts)
{
    float change_k = temperature_counts * correction->kelvin_per_count + correction->kelvin_at_zero;
    if (change_k > correction->least_k)
        return change_k < correction->most_k ? change_k : correction->most_k;
    return correction->least_k;
}

void correction_apply(struct correction *correction, const struct reading *reading, int32_t rate_urad_s[3])
{
    float change_k = limit_temperature_change(correction, reading->temperature_counts), counts[3];
    if (change_k != correction->change_k)
        update_correction(correction, change_k);
    for (unsigned axis = 0; axis < 3; axis++)
        counts[axis] = reading->counts[axis] + correction->present_offset_counts[axis];
    for (unsigned row = 0; row < 3; row++) {
        const float *gain_urad_s = correction->present_gain_urad_s[row];
        rate_urad_s[row] =
            round_to_int32(counts[0] * gain_urad_s[0] + counts[1] * gain_urad_s[1] + counts[2] * gain_urad_s[2]);
    }
}
