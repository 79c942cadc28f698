#include "alone.h"

#include <stdbool.h>
#include <stdint.h>

#include "acquisition.h"
#include "calibrating.h"
#include "clock.h"
#include "hand.h"
#include "port.h"
#include "sensors.h"
#include "setups.h"

#define PRESSED_US 30000u /* shortest press, longer than contact bounce */
#define MOVES 12u
#define SCALE_STD 1e-3f
#define RATE_HZ 200.0f /* of a sensor that is not configured; the nearest is set */
#define RANGE_DEG_S 500.0f
#define RANGE_G 8.0f /* a range of every part */
#define NONE SENSOR_COUNT

static uint64_t up_us;  /* time at which the button was last up */
static bool is_handled; /* whether a session has begun for this press */

void alone_reset(void)
{
    up_us = clock_now();
    is_handled = false;
}

/* Returns the first gyroscope that streams accelerations too; no stream is changed. If none streams, the first that answers and
   can be configured. */
static uint8_t choose_gyroscope(void)
{
    for (uint8_t i = 0; i < GYROSCOPE_COUNT; i++) {
        struct configure_payload wanted = {.sensor = i, .rate_hz = RATE_HZ, .range_deg_s = RANGE_DEG_S, .range_g = RANGE_G};
        uint16_t who_am_i;
        if (acquisition_is_running() ? setups_of(i)->range_m_s2 > 0.0
                                     : sensors_identify(i, &who_am_i) == 0 && setups_configure(&wanted) == 0)
            return i;
    }
    return NONE;
}

static void begin_session(void)
{
    struct port_health health;
    port_health(&health);
    uint8_t sensor = health.clock_locked ? choose_gyroscope() : NONE; /* readings do not reveal the error of a clock without its
                                                                  crystal */
    if (sensor == NONE)
        return;
    if (!acquisition_is_running()) {
        acquisition_set_rate(sensor, setups_of(sensor)->rate_hz);
        calibrating_forget(sensor);
        acquisition_start(0);
    }
    hand_begin(sensor, MOVES, SCALE_STD);
}

void alone_run(void)
{
    uint64_t now_us = clock_now();
    bool lit = hand_lamp(now_us);
    port_set_lamp(lit);
    if (lit || !port_button_is_down()) {
        up_us = now_us;
        is_handled = is_handled && lit; /* the lamp is on the button's wire */
    } else if (!is_handled && now_us - up_us >= PRESSED_US) {
        is_handled = true;
        begin_session();
    }
}
