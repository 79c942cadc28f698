/* Gyroscope of Analog Devices' ADIS16465-1, -2 and -3 on SPI. */
#ifndef ADIS16465_H
#define ADIS16465_H

#include "sensor.h"

extern const struct sensor_driver adis16465_gyro;

#endif
