#include "settings.h"

const struct gyro_range *choose_range(float wanted_deg_s, const struct gyro_range *ranges, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (wanted_deg_s <= (float)ranges[i].deg_s)
            return &ranges[i];
    return NULL;
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
