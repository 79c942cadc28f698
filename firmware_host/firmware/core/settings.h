/* What configuring any of the parts has in common. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol.h"

#define COUNT(table) (sizeof(table) / sizeof(table)[0])
#define RADIANS(degrees) ((degrees) * 3.14159265358979323846 / 180.0)

struct gyro_range {
    double deg_s;
    uint8_t code; /* as the part's register has it */
    double sensitivity_rad_s;
};

/* Why what was asked for makes no sense for any part, or 0. */
uint8_t refuse_wanted(const struct configure_payload *wanted);

/* The same, and the smallest of the part's ranges that holds the wanted one; the table ascends. */
uint8_t choose_range(const struct configure_payload *wanted, const struct gyro_range *ranges, size_t count,
                     const struct gyro_range **range);

/* Nobody there, another part, or 0. A wire that nobody drives reads as all zeros or all ones. */
uint8_t refuse_identity(uint16_t who_am_i, uint16_t expected);

/* Is `a` nearer to `wanted` than `b`? */
bool is_nearer(double a, double b, float wanted);

/* The divider 1 … `max` that brings base_hz / divider nearest to `wanted_hz`. */
uint16_t nearest_divider(double base_hz, float wanted_hz, uint16_t max);

#endif
