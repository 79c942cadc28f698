#include "hand.h"

#include <string.h>

#include "clock.h"
#include "hand_solver.h"
#include "link.h"
#include "port.h"
#include "reply.h"
#include "sensors.h"
#include "setups.h"

#define BLOCK_S 0.1f          /* duration of a block of readings */
#define BLOCK_LEAST 4u        /* fewest readings in a block */
#define REST_US 1000000u      /* shortest rest */
#define SETTLED_RAD_S 0.05f   /* largest scatter of readings at rest, */
#define NOISE_RATIO 4.0f      /* and largest ratio of its square to that of the quietest rest, */
#define TREMOR_RAD_S 0.002f   /* plus this */
#define CHANGE_STDS 5.0f      /* change of a block's mean, in its standard deviations, */
#define CHANGE_RAD_S 0.0015f  /* plus this, beyond which a move has begun */
#define TURNING_RAD_S 0.03f   /* from the first rest's mean; more is neither bias drift nor g-sensitivity */
#define ON_FACE 0.97f         /* cosine squared of the reading's angle from an axis: 10 degrees */
#define NUDGE_RAD 0.5f        /* a smaller rotation on one face is no move */
#define WHOLE_RAD 3.1415927f  /* a larger rotation on one face is intended as a whole revolution */
#define MAX_REFUSED 10u       /* refused moves in a row, after which the session ends: something else is wrong */
#define NO_FACE 255u
#define CRYSTALS_US (1e-6f * 4e6f / (122.0f * 32768.0f)) /* the clock locked to the crystal runs at 122 times its frequency, not
                                                            4 MHz */

/* Sums of readings, in counts. */
struct block {
    uint64_t start_us; /* of the first reading */
    int32_t sums[3], acceleration[3];
    int64_t squares; /* of all three axes */
    uint32_t samples;
    float duration_s; /* from the last reading before it to its last one */
};

struct rest {
    uint64_t start_us;
    int64_t sums[3], acceleration[3];
    uint32_t samples, blocks;
    float variance; /* of a reading: the sum over its blocks */
    uint8_t face;
    bool counted; /* whether its mean is in the estimate */
};

/* The sums of two consecutive rests and of the move between them. */
static struct {
    uint8_t sensor, state, wanted, accepted, refused;
    float wanted_std, scale_std, sensitivity, microsecond_s, noise_rad_s, first_rad_s[3];
    float range_deg_s, temperature_c; /* of the sensor: as configured; when it was last laid down */
    int16_t temperature_counts;
    int32_t end_of_range;
    uint32_t per_block, sequence;
    uint64_t last_us, judged_us;
    bool has_readings, is_at_rest; /* whether readings have come, and whether the last block was at rest */
    bool lost, clipped; /* flags of the move */

    struct block block, pending; /* `pending` is of a rest, but the move may have begun in it */
    struct rest before, now;     /* `now` is still too short */
    uint64_t move_start_us;      /* the first reading of the present move */
    float level[3], bias[3], up[3];
    struct motion motion, ended; /* `ended` is the motion at the start of the rest after it */
    struct estimate estimate;

    struct hand_report_payload report; /* the report on the last judged move */
} hand;

_Static_assert(sizeof hand <= 4096u, "a session by hand takes 4 KB of RAM at most");

void hand_reset(void)
{
    memset(&hand, 0, sizeof hand);
}

void hand_forget(unsigned sensor)
{
    if (hand.state < HAND_DONE && hand.sensor == sensor) /* an answer remains until the next session */
        hand_reset();
}

void hand_begin(uint8_t sensor, uint8_t moves, float scale_std)
{
    const struct setup_payload *setup = setups_of(sensor);
    hand_reset();
    hand.sensor = sensor;
    hand.state = HAND_STARTING;
    hand.wanted = moves;
    hand.wanted_std = scale_std;
    hand.sensitivity = (float)setup->sensitivity_rad_s;
    hand.range_deg_s = (float)setup->range_deg_s;
    struct port_health health;
    port_health(&health);
    hand.microsecond_s = health.clock_locked ? CRYSTALS_US : 1e-6f;
    float range = 0.995f * (float)setup->range_deg_s * 0.017453293f / hand.sensitivity;
    hand.end_of_range = range < 32767.0f ? (int32_t)range : INT16_MAX;
    uint32_t per_block = (uint32_t)(BLOCK_S * (float)setup->rate_hz);
    hand.per_block = per_block > BLOCK_LEAST ? per_block : BLOCK_LEAST;
    hand.before.face = NO_FACE;
    hand.report.before = hand.report.after = NO_FACE;
    estimate_begin(&hand.estimate);
    hand.scale_std = estimate_scale_std(&hand.estimate);
    motion_begin(&hand.motion);
}

/* The mean of a block, rad/s, and the variance of a reading in it. */
static float average_block(const struct block *block, float mean_rad_s[3])
{
    float samples = (float)block->samples;
    int64_t squared_sums = 0;
    for (unsigned axis = 0; axis < 3; axis++) {
        squared_sums += (int64_t)block->sums[axis] * block->sums[axis];
        mean_rad_s[axis] = (float)block->sums[axis] / samples * hand.sensitivity;
    }
    int64_t scatter = block->squares * (int64_t)block->samples - squared_sums; /* whole numbers: no rounding */
    return (float)scatter / (3.0f * samples * (samples - 1.0f)) * hand.sensitivity * hand.sensitivity;
}

static void average_rest(const struct rest *rest, float mean_rad_s[3])
{
    for (unsigned axis = 0; axis < 3; axis++)
        mean_rad_s[axis] = (float)rest->sums[axis] / (float)rest->samples * hand.sensitivity;
}

static void add_block(struct rest *rest, const struct block *block, float variance)
{
    if (rest->samples == 0)
        rest->start_us = block->start_us;
    for (unsigned axis = 0; axis < 3; axis++) {
        rest->sums[axis] += block->sums[axis];
        rest->acceleration[axis] += block->acceleration[axis];
    }
    rest->samples += block->samples;
    rest->blocks++;
    rest->variance += variance;
}

/* Returns the upper face, by the largest of three accelerations. */
static uint8_t find_upper_face(const struct rest *rest)
{
    float square = 0.0f, largest = 0.0f;
    uint8_t face = NO_FACE;
    for (unsigned axis = 0; axis < 3; axis++) {
        float reading = (float)rest->acceleration[axis];
        square += reading * reading;
        if (__builtin_fabsf(reading) > __builtin_fabsf(largest)) {
            largest = reading;
            face = (uint8_t)(2u * axis + (reading < 0.0f));
        }
    }
    return largest * largest > ON_FACE * square ? face : NO_FACE;
}

/* Starts a possible move with the last block of the rest, as one step. */
static void begin_move(void)
{
    const struct block *block = &hand.pending;
    float rate[3], mean_rad_s[3];
    average_rest(&hand.before, hand.bias);
    average_block(block, mean_rad_s);
    for (unsigned axis = 0; axis < 3; axis++)
        rate[axis] = mean_rad_s[axis] - hand.bias[axis];
    hand.lost = hand.clipped = false;
    hand.move_start_us = block->start_us;
    motion_begin(&hand.motion);
    motion_add(&hand.motion, hand.estimate.centre, hand.up, rate, block->duration_s, block->samples);
}

static struct hand_rest make_hand_rest(const struct rest *rest)
{
    struct hand_rest result = {.face = rest->face, .samples = rest->samples};
    average_rest(rest, result.mean_rad_s);
    return result;
}

static float length2(const float a[3])
{
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
}

static uint8_t find_outcome(struct rest *after)
{
    struct rest *before = &hand.before;
    const struct motion *motion = &hand.ended;
    if (after->face == NO_FACE)
        return MOVE_NO_FACE;
    bool is_same_face = after->face == before->face;
    if (before->face == NO_FACE || (is_same_face && length2(motion->rotation_rad) < NUDGE_RAD * NUDGE_RAD))
        return MOVE_NOTHING;
    if (hand.clipped)
        return MOVE_CLIPPED;
    if (hand.lost)
        return MOVE_LOST;
    const struct hand_rest rests[2] = {make_hand_rest(before), make_hand_rest(after)};
    const float *rotation_rad = motion->rotation_rad;
    float vertical_rad = rotation_rad[0] * hand.up[0] + rotation_rad[1] * hand.up[1] + rotation_rad[2] * hand.up[2];
    const struct hand_move move = {
        .motion = motion,
        .before = &rests[0],
        .after = &rests[1],
        .noise_rad_s = hand.noise_rad_s,
        .whole = is_same_face && __builtin_fabsf(vertical_rad) > WHOLE_RAD && hand.estimate.settled,
    };
    hand.report.whole = move.whole;
    if (!estimate_take(&hand.estimate, &move, !before->counted))
        return MOVE_CONTRADICTS;
    hand.report.settled = hand.estimate.settled;
    after->counted = true;
    if (hand.accepted < UINT8_MAX)
        hand.accepted++;
    hand.scale_std = estimate_scale_std(&hand.estimate);
    return MOVE_ACCEPTED;
}

static void judge(struct rest *after)
{
    struct hand_report_payload *report = &hand.report;
    report->whole = report->settled = 0;
    uint8_t outcome = find_outcome(after);
    report->outcome = outcome;
    report->before = hand.before.face;
    report->judged++;
    report->angle_rad = hand.ended.path_rad;
    report->noise_rad_s = hand.noise_rad_s;
    report->rest_us = hand.before.start_us;
    report->move_us = hand.move_start_us;
    report->after_us = after->start_us;
    report->end_us = hand.pending.start_us;
    hand.judged_us = hand.last_us;
    if (outcome != MOVE_NOTHING)
        hand.refused = outcome == MOVE_ACCEPTED ? 0 : hand.refused + 1;
}

/* Completes a rest that has lasted long enough. */
static void complete_rest(void)
{
    struct rest *after = &hand.now;
    bool is_first = hand.before.samples == 0;
    float noise_rad_s = __builtin_sqrtf(after->variance / (float)after->blocks);
    const struct setup_payload *setup = setups_of(hand.sensor);
    hand.temperature_c =
        (float)setup->temperature_scale_c * hand.temperature_counts + (float)setup->temperature_offset_c;
    if (is_first)
        average_rest(after, hand.first_rad_s);
    if (is_first || noise_rad_s < hand.noise_rad_s)
        hand.noise_rad_s = noise_rad_s;
    after->face = hand.report.after = find_upper_face(after);
    if (!is_first)
        judge(after);
    hand.before = *after;
    memset(after, 0, sizeof *after);
    if (hand.before.face != NO_FACE)
        estimate_up(&hand.estimate, hand.before.face, hand.up);
    begin_move();
    if (hand.accepted >= hand.wanted && hand.scale_std <= hand.wanted_std)
        hand.state = HAND_DONE;
    else
        hand.state = hand.refused < MAX_REFUSED ? HAND_RESTING : HAND_FAILED;
}

/* Returns whether a block belongs to a rest, and to the present one. */
static bool is_still(const float mean_rad_s[3], float variance)
{
    bool is_first = hand.before.samples == 0;
    float noise2 = is_first ? variance : hand.noise_rad_s * hand.noise_rad_s;
    float limit = is_first ? SETTLED_RAD_S * SETTLED_RAD_S : NOISE_RATIO * noise2 + TREMOR_RAD_S * TREMOR_RAD_S;
    if (variance > limit)
        return false;
    float max_change_rad_s = CHANGE_STDS * __builtin_sqrtf(noise2 / (float)hand.per_block) + CHANGE_RAD_S;
    for (unsigned axis = 0; axis < 3; axis++) {
        if (hand.is_at_rest && __builtin_fabsf(mean_rad_s[axis] - hand.level[axis]) > max_change_rad_s)
            return false;
        if (!is_first && __builtin_fabsf(mean_rad_s[axis] - hand.first_rad_s[axis]) > TURNING_RAD_S)
            return false;
    }
    return true;
}

static void enter_move(void)
{
    hand.state = hand.before.samples != 0 ? HAND_MOVING : HAND_STARTING;
    hand.is_at_rest = false;
}

/* Adds a block to a rest once the next one belongs to it too. */
static void add_pending(struct rest *rest)
{
    if (hand.pending.samples != 0) {
        float mean_rad_s[3];
        add_block(rest, &hand.pending, average_block(&hand.pending, mean_rad_s));
        average_rest(rest, hand.level);
    }
    hand.pending = hand.block;
}

static void complete_block(void)
{
    float mean_rad_s[3], variance = average_block(&hand.block, mean_rad_s);
    if (!is_still(mean_rad_s, variance)) {
        enter_move();
    } else if (hand.state == HAND_RESTING) {
        add_pending(&hand.before);
        begin_move();
    } else if (!hand.is_at_rest) { /* the first block still belongs to the move */
        hand.is_at_rest = true;
        hand.ended = hand.motion;
        hand.pending.samples = 0;
        memset(&hand.now, 0, sizeof hand.now);
        memcpy(hand.level, mean_rad_s, sizeof hand.level);
    } else {
        add_pending(&hand.now);
        if (hand.now.samples != 0 && hand.last_us - hand.now.start_us >= REST_US)
            complete_rest();
    }
    memset(&hand.block, 0, sizeof hand.block);
}

static void add_reading(uint64_t time_us, const struct reading *reading)
{
    struct block *block = &hand.block;
    float rate[3], dt_s = (float)(time_us - hand.last_us) * hand.microsecond_s;
    if (block->samples == 0)
        block->start_us = time_us;
    for (unsigned axis = 0; axis < 3; axis++) {
        int32_t counts = reading->counts[axis];
        hand.clipped = hand.clipped || counts >= hand.end_of_range || counts <= -hand.end_of_range;
        rate[axis] = (float)counts * hand.sensitivity - hand.bias[axis];
        block->sums[axis] += counts;
        block->acceleration[axis] += reading->acceleration[axis];
        block->squares += counts * counts;
    }
    hand.temperature_counts = reading->temperature_counts;
    block->samples++;
    block->duration_s += dt_s;
    motion_add(&hand.motion, hand.estimate.centre, hand.up, rate, dt_s, 1);
}

void hand_add(unsigned sensor, uint64_t time_us, uint32_t sequence, const struct reading *reading)
{
    if (sensor != hand.sensor || hand.state == HAND_IDLE || hand.state >= HAND_DONE)
        return;
    bool is_consecutive = hand.has_readings && sequence == hand.sequence + 1u;
    if (is_consecutive) {
        add_reading(time_us, reading);
    } else { /* neither a block nor a rest may contain a gap */
        hand.lost = true;
        memset(&hand.block, 0, sizeof hand.block);
        enter_move();
    }
    hand.has_readings = true;
    hand.sequence = sequence;
    hand.last_us = time_us;
    if (hand.block.samples == hand.per_block)
        complete_block();
}

#define SHOWN_MS 2000u

bool hand_lamp(uint64_t now_us)
{
    uint32_t elapsed_ms = (uint32_t)((now_us - hand.judged_us) / 1000u);
    bool is_refused = hand.report.outcome > MOVE_ACCEPTED;
    if (hand.state == HAND_DONE)
        return elapsed_ms % 1000u < 100u;
    if (hand.state == HAND_FAILED)
        return elapsed_ms / 50u % 2u != 0;
    if (hand.state != HAND_RESTING)
        return false;
    return elapsed_ms >= SHOWN_MS || hand.report.outcome == MOVE_NOTHING || elapsed_ms / (is_refused ? 50u : 250u) % 2u != 0;
}

void hand_on_begin(const struct frame *request)
{
    struct by_hand_payload wanted;
    memcpy(&wanted, request->payload, sizeof wanted);
    enum error_code error = setups_check(wanted.sensor);
    if (!error && !(setups_of(wanted.sensor)->range_m_s2 > 0.0))
        error = ERROR_BAD_RANGE;
    if (error) {
        reply_refused(request, error, wanted.sensor);
        return;
    }
    hand_begin(wanted.sensor, wanted.moves, wanted.scale_std);
    reply_done(request->sequence);
}

void hand_on_status(const struct frame *request)
{
    struct hand_report_payload report = hand.report;
    report.reply_to = request->sequence;
    report.sensor = hand.sensor;
    report.state = hand.state;
    report.accepted = hand.accepted;
    report.scale_std = hand.scale_std;
    link_send(MESSAGE_HAND_REPORT, &report, sizeof report);
}

void hand_on_solve(const struct frame *request)
{
    float result[HAND_UNKNOWNS];
    estimate_solution(&hand.estimate, result);
    struct hand_solution_payload answer = {
        .reply_to = request->sequence,
        .sensor = hand.sensor,
        .state = hand.state,
        .accepted = hand.accepted,
        .scale_std = hand.scale_std,
        .range_deg_s = hand.range_deg_s,
        .temperature_c = hand.temperature_c,
    };
    memcpy(answer.matrix, &result[HAND_MATRIX], sizeof answer.matrix);
    memcpy(answer.g_sensitivity_rad_s, &result[HAND_GRAVITY], sizeof answer.g_sensitivity_rad_s);
    for (unsigned axis = 0; axis < 3; axis++)
        answer.bias_rad_s[axis] = -result[HAND_BIAS + axis];
    link_send(MESSAGE_HAND_SOLUTION, &answer, sizeof answer);
}
