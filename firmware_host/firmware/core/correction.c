#include "correction.h"

#include "protocol.h"

#define LARGEST 2147483520.0f /* the largest float below 2³¹ */

struct correction correction_of(const float matrix[3][3], const float bias_rad_s[3], float sensitivity_rad_s)
{
    struct correction correction = {0};
    for (unsigned row = 0; row < 3; row++)
        for (unsigned axis = 0; axis < 3; axis++) {
            correction.gain_urad_s[row][axis] = matrix[row][axis] * sensitivity_rad_s * CALIBRATED_PER_RAD_S;
            correction.offset_urad_s[row] += matrix[row][axis] * bias_rad_s[axis] * CALIBRATED_PER_RAD_S;
        }
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

void correction_apply(const struct correction *correction, const int16_t counts[3], int32_t rate_urad_s[3])
{
    for (unsigned row = 0; row < 3; row++) {
        const float *gain_urad_s = correction->gain_urad_s[row];
        rate_urad_s[row] = rounded(counts[0] * gain_urad_s[0] + counts[1] * gain_urad_s[1] + counts[2] * gain_urad_s[2] +
                                   correction->offset_urad_s[row]);
    }
}
