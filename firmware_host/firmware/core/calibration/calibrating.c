#include "calibrating.h"

#include <stdbool.h>
#include <string.h>

#include "kept.h"
#include "link.h"
#include "reply.h"
#include "sensors.h"
#include "setups.h"
#include "solver.h"

static struct session {
    struct accumulator accumulator;
    uint8_t type; /* type and payload of the last executed request: a host that missed the answer repeats it */
    uint8_t request[sizeof(struct observe_payload)];
    struct observed_payload answer;
} sessions[GYROSCOPE_COUNT];

_Static_assert(sizeof(struct recall_payload) <= sizeof(struct observe_payload), "both fit the session");

void calibrating_reset(void)
{
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        calibrating_forget(i);
}

void calibrating_forget(unsigned sensor)
{
    kept_forget(sensor);
    if (sensor < GYROSCOPE_COUNT)
        memset(&sessions[sensor], 0, sizeof sessions[sensor]);
}

void calibrating_on_keep(const struct frame *request)
{
    struct keep_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    float rates_hz[SENSOR_COUNT];
    uint8_t sensor;
    enum error_code error = setups_check_mask(wanted.sensors, &sensor);
    if (error) {
        reply_refused(request, error, sensor);
        return;
    }
    for (unsigned i = 0; i < SENSOR_COUNT; i++)
        rates_hz[i] = is_named(wanted.sensors, i) ? (float)setups_of(i)->rate_hz : 0.0f;
    if (kept_begin(rates_hz, wanted.duration_s))
        reply_done(request->sequence);
    else
        reply_refused(request, ERROR_BAD_OBSERVATION, 0);
}

/* Returns the session of a request for one configured sensor; NULL if the request has been answered: refused, or a repetition.
   */
static struct session *find_session(const struct frame *request)
{
    uint8_t sensor = request->payload[0];
    enum error_code error = setups_check(sensor);
    if (error) {
        reply_refused(request, error, sensor);
        return NULL;
    }
    struct session *session = &sessions[sensor];
    if (session->type != request->type || memcmp(session->request, request->payload, request->size) != 0)
        return session;
    session->answer.reply_to = request->sequence;
    link_send(MESSAGE_OBSERVED, &session->answer, sizeof session->answer);
    return NULL;
}

static bool is_next(const struct session *session, uint16_t index)
{
    return index == 0 || (index == session->accumulator.count && index < UINT16_MAX);
}

static void add_observation(struct session *session, const struct frame *request, const struct observed_payload *observed,
                            float speed_rad_s)
{
    float mean_rad_s[3];
    memcpy(mean_rad_s, observed->mean_rad_s, sizeof mean_rad_s);
    if (observed->index == 0)
        solver_begin(&session->accumulator);
    solver_add(&session->accumulator, mean_rad_s, speed_rad_s);
    session->type = request->type;
    memcpy(session->request, request->payload, request->size);
    session->answer = *observed;
    link_send(MESSAGE_OBSERVED, observed, sizeof *observed);
}

static bool is_speed(float speed_rad_s)
{
    return __builtin_isfinite(speed_rad_s) && speed_rad_s > 0.0f;
}

void calibrating_on_observe(const struct frame *request)
{
    struct observe_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    struct session *session = find_session(request);
    if (session == NULL)
        return;
    if (!is_next(session, wanted.index) || !is_speed(wanted.speed_rad_s) || wanted.end_us <= wanted.start_us) {
        reply_refused(request, ERROR_BAD_OBSERVATION, wanted.sensor);
        return;
    }
    struct kept_span span;
    if (!kept_sum(wanted.sensor, wanted.start_us, wanted.end_us, &span)) {
        reply_refused(request, ERROR_NOT_KEPT, wanted.sensor);
        return;
    }
    struct observed_payload observed = {
        .reply_to = request->sequence,
        .sensor = wanted.sensor,
        .index = wanted.index,
        .start_us = span.start_us,
        .end_us = span.end_us,
        .samples = span.samples,
    };
    float per_count = (float)setups_of(wanted.sensor)->sensitivity_rad_s / (float)span.samples;
    for (unsigned axis = 0; axis < 3; axis++)
        observed.mean_rad_s[axis] = (float)span.sums[axis] * per_count;
    add_observation(session, request, &observed, wanted.speed_rad_s);
}

void calibrating_on_recall(const struct frame *request)
{
    struct recall_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    struct session *session = find_session(request);
    if (session == NULL)
        return;
    bool finite = true;
    for (unsigned axis = 0; axis < 3; axis++)
        finite = finite && __builtin_isfinite(wanted.mean_rad_s[axis]);
    if (!finite || !is_next(session, wanted.index) || !is_speed(wanted.speed_rad_s)) {
        reply_refused(request, ERROR_BAD_OBSERVATION, wanted.sensor);
        return;
    }
    struct observed_payload observed = {.reply_to = request->sequence, .sensor = wanted.sensor, .index = wanted.index};
    memcpy(observed.mean_rad_s, wanted.mean_rad_s, sizeof observed.mean_rad_s);
    add_observation(session, request, &observed, wanted.speed_rad_s);
}

void calibrating_on_solve(const struct frame *request)
{
    struct solve_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    enum error_code error = sensors_check_gyroscope(wanted.sensor);
    if (error) {
        reply_refused(request, error, wanted.sensor);
        return;
    }
    const struct accumulator *accumulator = &sessions[wanted.sensor].accumulator;
    struct solution solution;
    solver_solve(accumulator, (enum solve_method)wanted.method, &solution);
    struct solution_payload answer = {
        .reply_to = request->sequence,
        .sensor = wanted.sensor,
        .method = wanted.method,
        .status = (uint8_t)solution.status,
        .observations = accumulator->count,
        .iterations = solution.iterations,
    };
    memcpy(answer.scale, solution.scale, sizeof answer.scale);
    memcpy(answer.bias_rad_s, solution.bias_rad_s, sizeof answer.bias_rad_s);
    link_send(MESSAGE_SOLUTION, &answer, sizeof answer);
}
