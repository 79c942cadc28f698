#include "correction.h"

#include <string.h>

#include "protocol.h"

#define LARGEST 2147483520.0f /* the largest float below 2³¹ */

static float polynomial(const float change[3][3], unsigned axis, float warmer)
{
    return warmer * (change[0][axis] + warmer * (change[1][axis] + warmer * change[2][axis]));
}

static void work_out(struct correction *correction, float warmer)
{
    correction->warmer_k = warmer;
    for (unsigned axis = 0; axis < 3; axis++) {
        float share = 1.0f + polynomial(correction->scale_change, axis, warmer);
        for (unsigned row = 0; row < 3; row++)
            correction->gain_there_urad_s[row][axis] = correction->gain_urad_s[row][axis] * share;
        correction->offset_there_counts[axis] =
            correction->offset_counts[axis] + polynomial(correction->offset_change_counts, axis, warmer);
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
    work_out(&correction, 0.0f);
    return correction;
}

static int32_t rounded(float value)
{
    if (value >= LARGEST)
        return INT32_MAX;
    if (value <= -LARGEST)
        return -INT32_MAX;
    return (int32_t)(value < 0.0f ? value - 0.5f : value + 0.5f);
}

/* Returns the difference from the temperature of matrix and bias, limited to the polynomials' range. */
static float warmer_k(const struct correction *correction, int16_t temperature_counts)
{
    float warmer = temperature_counts * correction->kelvin_per_count + correction->kelvin_at_zero;
    if (warmer > correction->least_k)
        return warmer < correction->most_k ? warmer : correction->most_k;
    return correction->least_k;
}

void correction_apply(struct correction *correction, const struct reading *reading, int32_t rate_urad_s[3])
{
    float warmer = warmer_k(correction, reading->temperature_counts), counts[3];
    if (warmer != correction->warmer_k)
        work_out(correction, warmer);
    for (unsigned axis = 0; axis < 3; axis++)
        counts[axis] = reading->counts[axis] + correction->offset_there_counts[axis];
    for (unsigned row = 0; row < 3; row++) {
        const float *gain_urad_s = correction->gain_there_urad_s[row];
        rate_urad_s[row] =
            rounded(counts[0] * gain_urad_s[0] + counts[1] * gain_urad_s[1] + counts[2] * gain_urad_s[2]);
    }
}
