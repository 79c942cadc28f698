/* The drivers of the board's sensors, by number: they depend on each other only through this. */
#ifndef DRIVERS_H
#define DRIVERS_H

#include "board_parts.h"
#include "sensor.h"

/* Devices of the bus and data-ready lines are numbered as the sensors are. */
#define NUMBER(driver, ...) SENSOR_##driver,
enum sensor_number { SENSORS(NUMBER) };
#undef NUMBER

#define DECLARE(driver, ...) extern const struct sensor_driver driver;
SENSORS(DECLARE)
#undef DECLARE

#endif
