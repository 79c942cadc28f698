#include "settings.h"

uint8_t refuse_wanted(const struct configure_payload *wanted)
{
    if (!(wanted->rate_hz > 0.0f && wanted->rate_hz < 1e6f))
        return ERROR_BAD_RATE;
    return wanted->range_deg_s > 0.0f ? 0 : ERROR_BAD_RANGE;
}

uint8_t refuse_identity(uint16_t who_am_i, uint16_t expected)
{
    if (who_am_i == expected)
        return 0;
    return who_am_i == 0 || who_am_i == 0xFFu || who_am_i == 0xFFFFu ? ERROR_SENSOR_ABSENT : ERROR_SENSOR_MISMATCH;
}

uint8_t choose_range(const struct configure_payload *wanted, const struct gyro_range *ranges, size_t count,
                     const struct gyro_range **range)
{
    uint8_t error = refuse_wanted(wanted);
    if (error)
        return error;
    for (size_t i = 0; i < count; i++)
        if (wanted->range_deg_s <= (float)ranges[i].deg_s) {
            *range = &ranges[i];
            return 0;
        }
    return ERROR_BAD_RANGE;
}

static float distance(double a, float b)
{
    return __builtin_fabsf((float)a - b);
}

bool is_nearer(double a, double b, float wanted)
{
    return distance(a, wanted) < distance(b, wanted);
}

uint16_t nearest_divider(double base_hz, float wanted_hz, uint16_t max)
{
    float exact = (float)base_hz / wanted_hz;
    if (exact < 1.0f)
        return 1;
    if (exact >= (float)max)
        return max;
    uint16_t below = (uint16_t)exact;
    return is_nearer(base_hz / (below + 1), base_hz / below, wanted_hz) ? (uint16_t)(below + 1) : below;
}
