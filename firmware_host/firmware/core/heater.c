#include "heater.h"

#include <stdbool.h>
#include <string.h>

#include "acquisition.h"
#include "clock.h"
#include "link.h"
#include "port.h"
#include "sensors.h"
#include "setups.h"

#define THERMOMETER_SILENT_US 1000000u /* many readings, at any rate of a part */

static uint8_t power;
static uint8_t cause; /* enum heater_cause: the reason for being off */
static uint64_t request_us; /* time of the host's latest request */
static float hottest_c;

static void switch_off(enum heater_cause new_cause)
{
    power = 0;
    cause = (uint8_t)new_cause;
    port_heat(0);
}

void heater_reset(void)
{
    request_us = 0;
    hottest_c = 0.0f;
    switch_off(HEATER_NOT_WANTED);
}

/* Reads every thermometer. False if there is none, or one without a recent reading: without a temperature the heater must be
   off. */
static bool read_thermometers(uint64_t now_us)
{
    bool has_temperature = false;
    for (unsigned i = 0; i < SENSOR_COUNT; i++) {
        const struct setup_payload *setup = setups_of(i);
        int16_t counts;
        uint64_t read_us;
        if (setup->rate_hz == 0.0 || setup->temperature_scale_c == 0.0)
            continue;
        if (!acquisition_temperature(i, &counts, &read_us) || now_us > read_us + THERMOMETER_SILENT_US)
            return false;
        float temperature_c = (float)setup->temperature_scale_c * counts + (float)setup->temperature_offset_c;
        if (!has_temperature || temperature_c > hottest_c)
            hottest_c = temperature_c;
        has_temperature = true;
    }
    return has_temperature;
}

/* After overheating it stays off until the host has switched it off: otherwise the next request would switch it on again. */
static void enforce_limits(void)
{
    uint64_t now_us = clock_now();
    if (!read_thermometers(now_us))
        switch_off(HEATER_NO_THERMOMETER);
    else if (hottest_c >= HEATER_LIMIT_C)
        switch_off(HEATER_TOO_HOT);
    else if (now_us - request_us >= HEATER_WORD_US)
        switch_off(HEATER_NO_WORD);
}

void heater_run(void)
{
    if (power != 0)
        enforce_limits();
}

void heater_on_heat(const struct frame *request)
{
    struct heat_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    request_us = clock_now();
    if (wanted.power == 0) {
        switch_off(HEATER_NOT_WANTED);
    } else if (cause != HEATER_TOO_HOT) {
        power = wanted.power;
        cause = HEATER_ON;
        enforce_limits();
    }
    if (power != 0)
        port_heat(power);
    struct heating_payload heating = {
        .reply_to = request->sequence, .power = power, .cause = cause, .temperature_c = hottest_c};
    link_send(MESSAGE_HEATING, &heating, sizeof heating);
}
