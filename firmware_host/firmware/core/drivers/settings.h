/* Common functions for configuring the parts. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol.h"

#define COUNT(table) (sizeof(table) / sizeof(table)[0])
#define RADIANS(degrees) ((degrees) * 3.14159265358979323846 / 180.0)

#define TESLA(gauss) ((gauss) * 1e-4)

#define STANDARD_GRAVITY_M_S2 9.80665 /* the g of data sheets */

/* Of angular rates, in degrees per second and rad/s per count, of accelerations, in g and g per count, or of the magnetic
   field, in gauss and gauss per count. */
struct range {
    double full_scale;
    uint8_t code; /* in the part's register */
    double per_count;
};

/* The first entry of a table of ranges of accelerations: none requested. */
#define NO_ACCELERATION {0.0, 0, 0.0}

/* Returns the part's smallest range that covers the wanted one; NULL if there is none. The table ascends. */
const struct range *choose_range(float wanted, const struct range *ranges, size_t count);

/* Writes the chosen ranges into `setup`. */
void tell_ranges(const struct range *rate, const struct range *acceleration, struct setup_payload *setup);

/* Returns whether `a` is nearer to `wanted` than `b`. */
bool is_nearer(double a, double b, float wanted);

/* Returns the divider 1 … `max` with base_hz / divider nearest to `wanted_hz`. */
uint16_t nearest_divider(double base_hz, float wanted_hz, uint16_t max);

#endif
