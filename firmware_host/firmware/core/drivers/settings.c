#include "settings.h"

const struct range *choose_range(float wanted, const struct range *ranges, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (wanted <= (float)ranges[i].full_scale)
            return &ranges[i];
    return NULL;
}

void tell_ranges(const struct range *rate, const struct range *acceleration, struct setup_payload *setup)
{
    setup->range_deg_s = rate->full_scale;
    setup->sensitivity_rad_s = rate->per_count;
    setup->range_m_s2 = STANDARD_GRAVITY_M_S2 * acceleration->full_scale;
    setup->sensitivity_m_s2 = STANDARD_GRAVITY_M_S2 * acceleration->per_count;
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
