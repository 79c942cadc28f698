/* Applies a calibration to readings: g = M S(T) (m + b(T)), from counts straight to microradians per second. S is diagonal,
   with each axis' scale factor relative to that at the temperature of M; S − 1 and b(T) − b are polynomials of temperature. */
#ifndef CORRECTION_H
#define CORRECTION_H

#include <stdint.h>

#include "sensor.h"

struct correction {
    float gain_urad_s[3][3]; /* per count */
    float offset_counts[3];
    float kelvin_per_count, kelvin_at_zero; /* the thermometer's, relative to the temperature of matrix and bias */
    float least_k, most_k;                  /* the polynomials' range */
    float scale_change[3][3], offset_change_counts[3][3]; /* per K, K², K³, by axis */
    /* Cached for the temperature of the last reading, which most readings share. */
    float change_k, present_gain_urad_s[3][3], present_offset_counts[3];
};

/* Prepares the correction for a part with this setup. */
struct correction correction_of(const struct calibration_payload *record, const struct setup_payload *setup);

/* Writes the calibrated rate, rounded and saturated. Single precision rounds a gain three times, its factor four times, their
   product once and each sum once: in addition to half a microradian per second the error is at most 8 · 2⁻²⁴ of the sum of the
   magnitudes without polynomials, which is 3 µrad/s at 245 °/s, where a count is 153. Polynomials add 8 · 2⁻²⁴ of it for the
   scale, and 8 · 2⁻²⁴ of the sum of their terms' magnitudes. */
void correction_apply(struct correction *correction, const struct reading *reading, int32_t rate_urad_s[3]);

#endif
