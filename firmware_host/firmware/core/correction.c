#include "correction.h"

#include "protocol.h"

#define LARGEST 2147483520.0f /* the largest float below 2³¹ */

struct correction correction_of(const float scale[3], const float bias_rad_s[3], float sensitivity_rad_s)
{
    struct correction correction;
    for (unsigned axis = 0; axis < 3; axis++) {
        correction.gain_urad_s[axis] = scale[axis] * sensitivity_rad_s * CALIBRATED_PER_RAD_S;
        correction.offset_urad_s[axis] = scale[axis] * bias_rad_s[axis] * CALIBRATED_PER_RAD_S;
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
    for (unsigned axis = 0; axis < 3; axis++)
        rate_urad_s[axis] = rounded(counts[axis] * correction->gain_urad_s[axis] + correction->offset_urad_s[axis]);
}
