#include "sensors.h"

#include <stddef.h>

_Static_assert(SENSOR_COUNT <= 8, "a message's mask has a bit for every sensor");

#define POINTER(driver, ...) &driver,
const struct sensor_driver *const drivers[SENSOR_COUNT] = {SENSORS(POINTER)};

void sensors_reset(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        if (drivers[i]->reset != NULL)
            drivers[i]->reset(i);
}

enum error_code sensors_check_gyroscope(uint8_t sensor)
{
    if (sensor >= SENSOR_COUNT)
        return ERROR_NO_SUCH_SENSOR;
    return sensor < GYROSCOPE_COUNT ? 0 : ERROR_NOT_A_GYROSCOPE;
}

/* An undriven wire reads as all zeros or all ones. */
static bool is_undriven(uint16_t who_am_i)
{
    return who_am_i == 0 || who_am_i == 0xFFu || who_am_i == 0xFFFFu;
}

enum error_code sensors_identify(unsigned sensor, uint16_t *who_am_i)
{
    const struct sensor_driver *driver = drivers[sensor];
    *who_am_i = driver->identify(sensor);
    if (*who_am_i == driver->identity) {
        if (driver->keep_to_spi != NULL)
            driver->keep_to_spi(sensor);
        return 0;
    }
    return is_undriven(*who_am_i) ? ERROR_SENSOR_ABSENT : ERROR_SENSOR_MISMATCH;
}
