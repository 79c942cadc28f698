/* Applies a calibration to readings: g = K (m + b), from counts straight to microradians per second. */
#ifndef CORRECTION_H
#define CORRECTION_H

#include <stdint.h>

struct correction {
    float gain_urad_s[3]; /* per count */
    float offset_urad_s[3];
};

/* For readings of so many rad/s per count. */
struct correction correction_of(const float scale[3], const float bias_rad_s[3], float sensitivity_rad_s);

/* The calibrated rate, rounded; what does not fit is the largest that does. */
void correction_apply(const struct correction *correction, const int16_t counts[3], int32_t rate_urad_s[3]);

#endif
