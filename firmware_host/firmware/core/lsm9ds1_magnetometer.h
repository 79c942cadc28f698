/* Magnetometer of ST's LSM9DS1 on SPI: a die of its own, with its own select, data-ready line and clock. */
#ifndef LSM9DS1_MAGNETOMETER_H
#define LSM9DS1_MAGNETOMETER_H

#include "sensor.h"

extern const struct sensor_driver lsm9ds1_magnetometer;

#endif
