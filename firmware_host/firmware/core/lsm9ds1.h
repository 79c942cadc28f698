/* Gyroscope of ST's LSM9DS1 on SPI. */
#ifndef LSM9DS1_H
#define LSM9DS1_H

#include "sensor.h"

extern const struct sensor_driver lsm9ds1_gyro;

#endif
