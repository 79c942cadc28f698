#include "setups.h"

#include <stdbool.h>
#include <string.h>

#include "sensors.h"

static struct setup_payload setups[SENSOR_COUNT];

void setups_reset(void)
{
    memset(setups, 0, sizeof setups);
}

/* Returns why a request is invalid for every part that measures this quantity, or 0. */
static enum error_code refuse_wanted(const struct configure_payload *wanted, uint8_t quantity)
{
    if (!(wanted->rate_hz > 0.0f && wanted->rate_hz < 1e6f))
        return ERROR_BAD_RATE;
    bool fits = quantity == QUANTITY_FIELD
                    ? wanted->range_gauss > 0.0f && wanted->range_deg_s == 0.0f && wanted->range_g == 0.0f
                    : wanted->range_deg_s > 0.0f && wanted->range_g >= 0.0f && wanted->range_gauss == 0.0f;
    return fits ? 0 : ERROR_BAD_RANGE;
}

enum error_code setups_configure(const struct configure_payload *wanted)
{
    const struct sensor_driver *driver = drivers[wanted->sensor];
    struct setup_payload *setup = &setups[wanted->sensor];
    uint16_t who_am_i;
    *setup = (struct setup_payload){.sensor = wanted->sensor};
    enum error_code error = refuse_wanted(wanted, driver->quantity);
    if (!error)
        error = sensors_identify(wanted->sensor, &who_am_i);
    if (!error)
        error = driver->configure(wanted->sensor, wanted, setup);
    if (error)
        setup->rate_hz = 0.0;
    return error;
}

const struct setup_payload *setups_of(unsigned sensor)
{
    return &setups[sensor];
}

enum error_code setups_check(uint8_t sensor)
{
    enum error_code error = sensors_check_gyroscope(sensor);
    return error || setups[sensor].rate_hz > 0.0 ? error : ERROR_NOT_CONFIGURED;
}

enum error_code setups_check_mask(uint8_t mask, uint8_t *wrong)
{
    enum error_code error = 0;
    for (*wrong = 0; mask >> *wrong != 0; ++*wrong) {
        error = is_named(mask, *wrong) ? setups_check(*wrong) : 0;
        if (error)
            break;
    }
    return error;
}
