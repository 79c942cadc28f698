/* What configuring any of the parts has in common. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define COUNT(table) (sizeof(table) / sizeof(table)[0])
#define RADIANS(degrees) ((degrees) * 3.14159265358979323846 / 180.0)

struct gyro_range {
    double deg_s;
    uint8_t code; /* as the part's register has it */
    double sensitivity_rad_s;
};

/* The smallest of the part's ranges that holds the wanted one; NULL when there is none. The table ascends. */
const struct gyro_range *choose_range(float wanted_deg_s, const struct gyro_range *ranges, size_t count);

/* Is `a` nearer to `wanted` than `b`? */
bool is_nearer(double a, double b, float wanted);

/* The divider 1 … `max` that brings base_hz / divider nearest to `wanted_hz`. */
uint16_t nearest_divider(double base_hz, float wanted_hz, uint16_t max);

#endif
