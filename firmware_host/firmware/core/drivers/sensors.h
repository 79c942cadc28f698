/* The board's sensors: the driver of each device on the port's bus. */
#ifndef SENSORS_H
#define SENSORS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers.h"

extern const struct sensor_driver *const drivers[SENSOR_COUNT];

/* Clears the drivers' states of their parts. */
void sensors_reset(void);

/* Returns 0 if there is such a gyroscope, or the reason why not. */
enum error_code sensors_check_gyroscope(uint8_t sensor);

/* Reads the identity register; 0 if it is the part's, else ERROR_SENSOR_ABSENT or ERROR_SENSOR_MISMATCH. */
enum error_code sensors_identify(unsigned sensor, uint16_t *who_am_i);

/* Returns whether a message's bit mask includes the sensor. */
static inline bool is_named(uint8_t mask, unsigned sensor)
{
    return (mask >> sensor & 1) != 0;
}

#endif
