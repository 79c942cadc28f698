/* The board's sensors: which driver serves which device of the port's bus. */
#ifndef SENSORS_H
#define SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers.h"

extern const struct sensor_driver *const drivers[SENSOR_COUNT];

/* What the drivers remember of their parts goes. */
void sensors_reset(void);

/* 0 when there is such a gyroscope, or why not. */
enum error_code sensors_check_gyroscope(uint8_t sensor);

/* Reads the identity register; 0 when it is the part's, or ERROR_SENSOR_ABSENT, or ERROR_SENSOR_MISMATCH. */
enum error_code sensors_identify(unsigned sensor, uint16_t *who_am_i);

/* Whether a message's bit mask names the sensor. */
static inline bool is_named(uint8_t mask, unsigned sensor)
{
    return (mask >> sensor & 1) != 0;
}

#endif
