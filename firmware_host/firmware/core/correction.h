/* Applies a calibration to readings: g = M (m + b), from counts straight to microradians per second. */
#ifndef CORRECTION_H
#define CORRECTION_H

#include <stdint.h>

struct correction {
    float gain_urad_s[3][3]; /* per count */
    float offset_urad_s[3];
};

/* For readings of so many rad/s per count. */
struct correction correction_of(const float matrix[3][3], const float bias_rad_s[3], float sensitivity_rad_s);

/* The calibrated rate, rounded; what does not fit is the largest that does. Single precision rounds a gain three times,
   its product once and each sum once: beside half a microradian per second the error is at most 8 · 2⁻²⁴ of the sum of
   the magnitudes, which is 3 µrad/s at 245 °/s, where a count is 153. */
void correction_apply(const struct correction *correction, const int16_t counts[3], int32_t rate_urad_s[3]);

#endif
