/* What configuring any of the parts has in common. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol.h"

#define COUNT(table) (sizeof(table) / sizeof(table)[0])
#define RADIANS(degrees) ((degrees) * 3.14159265358979323846 / 180.0)

#define TESLA(gauss) ((gauss) * 1e-4)

#define STANDARD_GRAVITY_M_S2 9.80665 /* what a data sheet's g is */

/* Of turn rates, in degrees per second and rad/s per count, of accelerations, in g and g per count, or of the magnetic
   field, in gauss and gauss per count. */
struct range {
    double full_scale;
    uint8_t code; /* as the part's register has it */
    double per_count;
};

/* What a table of ranges of accelerations begins with: they need not be read. */
#define NO_ACCELERATION {0.0, 0, 0.0}

/* The smallest of the part's ranges that holds the wanted one; NULL when there is none. The table ascends. */
const struct range *choose_range(float wanted, const struct range *ranges, size_t count);

/* Tells of the chosen ranges in `setup`. */
void tell_ranges(const struct range *rate, const struct range *acceleration, struct setup_payload *setup);

/* Is `a` nearer to `wanted` than `b`? */
bool is_nearer(double a, double b, float wanted);

/* The divider 1 … `max` that brings base_hz / divider nearest to `wanted_hz`. */
uint16_t nearest_divider(double base_hz, float wanted_hz, uint16_t max);

#endif
