#include "sensors.h"

#include <stddef.h>

#include "adis16465.h"
#include "lsm9ds1.h"
#include "lsm9ds1_magnetometer.h"
#include "mpu9250.h"
#include "port.h"

_Static_assert(SENSOR_COUNT <= BUS_DEVICES, "every sensor has its select");

const struct sensor sensors[SENSOR_COUNT] = {
    {&lsm9ds1_gyro, 0}, {&mpu9250_gyro, 1}, {&adis16465_gyro, 2}, {&lsm9ds1_magnetometer, BUS_LSM9DS1_MAGNETOMETER}};

void sensors_reset(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        if (sensors[i].driver->reset != NULL)
            sensors[i].driver->reset(sensors[i].device);
}

enum error_code sensors_check_gyroscope(uint8_t sensor)
{
    if (sensor >= SENSOR_COUNT)
        return ERROR_NO_SUCH_SENSOR;
    return sensor < GYROSCOPE_COUNT ? 0 : ERROR_NOT_A_GYROSCOPE;
}

/* A wire that nobody drives reads as all zeros or all ones. */
static bool is_nobody(uint16_t who_am_i)
{
    return who_am_i == 0 || who_am_i == 0xFFu || who_am_i == 0xFFFFu;
}

enum error_code sensors_identify(unsigned sensor, uint16_t *who_am_i)
{
    const struct sensor_driver *driver = sensors[sensor].driver;
    *who_am_i = driver->identify(sensors[sensor].device);
    if (*who_am_i == driver->identity) {
        if (driver->keep_to_spi != NULL)
            driver->keep_to_spi(sensors[sensor].device);
        return 0;
    }
    return is_nobody(*who_am_i) ? ERROR_SENSOR_ABSENT : ERROR_SENSOR_MISMATCH;
}
