/* Gyroscope of InvenSense's MPU-9250 on SPI. */
#ifndef MPU9250_H
#define MPU9250_H

#include "sensor.h"

extern const struct sensor_driver mpu9250_gyro;

#endif
