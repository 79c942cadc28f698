#include "hand_solver.h"

#include <string.h>

/* Prior standard deviations: of an element of C, of G (rad/s per g: 0.1 degrees per second), of b (rad/s), of a face's error of
   squareness (0.2 degrees). */
#define MATRIX_STD 0.2f
#define GRAVITY_STD 1.75e-3f
#define BIAS_STD 1.0f
#define FACE_STD 3.5e-3f

/* Errors of hand and part, as in rig/estimation/by_hand: of a face laid down again, of the heading after a whole revolution, of
   the angle of a move by nonlinearity and of a quarter revolution by itself, of a rest and of a move by the Earth's rate. */
#define REPEAT_RAD 3e-4f
#define CLOSURE_RAD 3e-3f
#define NONLINEARITY 1e-4f
#define OF_ANGLE 1e-4f
#define QUARTER_RAD 1.5707963f
#define EARTH_RAD_S 7e-5f
#define EARTH_ALONG_RAD_S 3e-5f

#define CURVED 0.02f   /* of the squared residual: the equations are linear, a rotation is not */
#define FARTHEST 0.8f  /* rad; the largest residual of a move with any part */
#define KNOWN_STD 0.01f /* of each element of C, below which the solution becomes the centre */
#define TOO_FAR 25.0f /* in units of the variance: 5 standard deviations */

struct equation {
    float row[HAND_UNKNOWNS];
    float missed, variance;
};

static float *row_of(struct estimate *estimate, unsigned i)
{
    return &estimate->r[i * HAND_UNKNOWNS - i * (i + 1u) / 2u]; /* and from there at its column */
}

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const float a[3], const float b[3], float product[3])
{
    product[0] = a[1] * b[2] - a[2] * b[1];
    product[1] = a[2] * b[0] - a[0] * b[2];
    product[2] = a[0] * b[1] - a[1] * b[0];
}

static void unit(float a[3])
{
    float inverse = 1.0f / __builtin_sqrtf(dot(a, a));
    for (unsigned i = 0; i < 3; i++)
        a[i] *= inverse;
}

static void apply(float r[3][3], const float a[3], float product[3])
{
    for (unsigned i = 0; i < 3; i++)
        product[i] = dot(r[i], a);
}

void estimate_begin(struct estimate *estimate)
{
    memset(estimate, 0, sizeof *estimate);
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float std = i < HAND_GRAVITY ? MATRIX_STD : i < HAND_BIAS ? GRAVITY_STD : i < HAND_FACES ? BIAS_STD : FACE_STD;
        row_of(estimate, i)[i] = 1.0f / std;
    }
    for (unsigned axis = 0; axis < 3; axis++)
        estimate->centre[HAND_MATRIX + 4u * axis] = 1.0f;
}

void estimate_up(const struct estimate *estimate, uint8_t face, float up[3])
{
    const float *leans = &estimate->centre[HAND_FACES + 2u * face];
    unsigned axis = face / 2u;
    float along = 1.0f - 0.5f * (leans[0] * leans[0] + leans[1] * leans[1]);
    up[axis] = face % 2u == 0 ? along : -along;
    up[(axis + 1u) % 3u] = leans[0];
    up[(axis + 2u) % 3u] = leans[1];
}

/* Rotates an equation into the triangle (Givens). */
static void fold(struct estimate *estimate, struct equation *equation)
{
    float weight = 1.0f / __builtin_sqrtf(equation->variance), missed = equation->missed * weight, *row = equation->row;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        row[i] *= weight;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float *r = row_of(estimate, i);
        if (row[i] == 0.0f)
            continue;
        float inverse = 1.0f / __builtin_sqrtf(r[i] * r[i] + row[i] * row[i]);
        float c = r[i] * inverse, s = row[i] * inverse;
        for (unsigned j = i; j < HAND_UNKNOWNS; j++) {
            float turned = c * r[j] + s * row[j];
            row[j] = c * row[j] - s * r[j];
            r[j] = turned;
        }
        float turned = c * estimate->amiss[i] + s * missed;
        missed = c * missed - s * estimate->amiss[i];
        estimate->amiss[i] = turned;
    }
}

/* x: the solution, relative to the centre. */
static void solve(const struct estimate *estimate, float x[HAND_UNKNOWNS])
{
    const float *r = &estimate->r[HAND_UNKNOWNS * (HAND_UNKNOWNS + 1u) / 2u];
    for (unsigned i = HAND_UNKNOWNS; i-- != 0;) {
        r -= HAND_UNKNOWNS - i;
        x[i] = estimate->amiss[i];
        for (unsigned j = i + 1u; j < HAND_UNKNOWNS; j++)
            x[i] -= r[j - i] * x[j];
        x[i] /= *r;
    }
}

void estimate_solution(const struct estimate *estimate, float found[HAND_UNKNOWNS])
{
    solve(estimate, found);
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        found[i] += estimate->centre[i];
}

/* Returns the variance of row times the unknowns: the square of R^-T row. */
static float variance_of(const struct estimate *estimate, const float row[HAND_UNKNOWNS])
{
    float rest[HAND_UNKNOWNS], sum = 0.0f;
    memcpy(rest, row, sizeof rest);
    const float *r = estimate->r;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float there = rest[i] / *r;
        for (unsigned j = i; j < HAND_UNKNOWNS; j++)
            rest[j] -= *r++ * there;
        sum += there * there;
    }
    return sum;
}

/* Returns the largest variance of every `step`th element of C. */
static float largest_variance(const struct estimate *estimate, unsigned step)
{
    float largest = 0.0f;
    for (unsigned i = HAND_MATRIX; i < HAND_GRAVITY; i += step) {
        float row[HAND_UNKNOWNS] = {0};
        row[i] = 1.0f;
        float variance = variance_of(estimate, row);
        largest = variance > largest ? variance : largest;
    }
    return largest;
}

float estimate_scale_std(const struct estimate *estimate)
{
    return __builtin_sqrtf(largest_variance(estimate, 4));
}

static void settle(struct estimate *estimate)
{
    estimate->settled = largest_variance(estimate, 1) < KNOWN_STD * KNOWN_STD;
    if (!estimate->settled)
        return;
    estimate_solution(estimate, estimate->amiss);
    memcpy(estimate->centre, estimate->amiss, sizeof estimate->centre);
    memset(estimate->amiss, 0, sizeof estimate->amiss);
}

/* Adds a rest's mean reading on one axis: b + G u. */
static void of_rest(const struct estimate *estimate, const struct hand_rest *rest, float noise_rad_s, unsigned axis, struct equation *found)
{
    float up[3];
    const float *gravity = &estimate->centre[HAND_GRAVITY + 3u * axis];
    estimate_up(estimate, rest->face, up);
    memset(found, 0, sizeof *found);
    memcpy(&found->row[HAND_GRAVITY + 3u * axis], up, sizeof up);
    found->row[HAND_BIAS + axis] = 1.0f;
    found->missed = rest->mean_rad_s[axis] - estimate->centre[HAND_BIAS + axis] - dot(gravity, up);
    found->variance = noise_rad_s * noise_rad_s / (float)rest->samples + EARTH_RAD_S * EARTH_RAD_S;
}

/* A move prepared for its equations: its rotation by the present solution, and its derivatives. */
struct turn {
    float up[3];             /* the vertical before, in the body before the move */
    float there[3];          /* the vertical after, rotated back into the body before: it should equal `up` */
    float middle[3];         /* between the two */
    float r[3][3];           /* body after to body before */
    float by_gravity[3][9];
    float corrected[3];      /* for the derivative of the bias, and G */
    float variance;          /* without those of its ends and of its curvature */
};

/* The bias is the mean of the two rests: it includes G u of both, but not the change of u(t) during the move. */
static void prepare(const struct estimate *estimate, const struct hand_move *move, struct turn *turn)
{
    const struct motion *motion = move->motion;
    const float *matrix = &estimate->centre[HAND_MATRIX], *gravity = &estimate->centre[HAND_GRAVITY];
    float after[3], mean_up[3], by_bias[3];
    estimate_up(estimate, move->before->face, turn->up);
    estimate_up(estimate, move->after->face, after);
    motion_attitude(motion->attitude, turn->r);
    for (unsigned c = 0; c < 3; c++)
        mean_up[c] = 0.5f * (turn->up[c] + after[c]);
    for (unsigned a = 0; a < 3; a++) {
        turn->corrected[a] = 0.0f;
        for (unsigned i = 0; i < 3; i++) {
            by_bias[i] = motion->turned[a][0] * matrix[i] + motion->turned[a][1] * matrix[3 + i] + motion->turned[a][2] * matrix[6 + i];
            turn->corrected[a] -= 0.5f * by_bias[i] * (move->after->mean_rad_s[i] - move->before->mean_rad_s[i]);
            for (unsigned c = 0; c < 3; c++) {
                const float *along = &motion->along[a][c];
                float by = by_bias[i] * mean_up[c] - along[0] * matrix[i] - along[3] * matrix[3 + i] - along[6] * matrix[6 + i];
                turn->by_gravity[a][3 * i + c] = by;
                turn->corrected[a] += by * gravity[3 * i + c];
            }
        }
    }
    float aside[3];
    apply(turn->r, after, turn->there);
    cross(turn->corrected, turn->there, aside);
    for (unsigned i = 0; i < 3; i++) {
        turn->there[i] += aside[i];
        turn->middle[i] = turn->there[i] + turn->up[i];
    }
    float path = motion->path_rad, lasts_s = motion->duration_s, noise2 = move->noise_rad_s * move->noise_rad_s;
    float samples = 1.0f / (float)motion->samples + 0.25f / (float)move->before->samples + 0.25f / (float)move->after->samples;
    turn->variance = lasts_s * lasts_s * (noise2 * samples + EARTH_ALONG_RAD_S * EARTH_ALONG_RAD_S) +
                     path * (NONLINEARITY * NONLINEARITY * path + OF_ANGLE * OF_ANGLE * QUARTER_RAD);
}

/* Adds the equation of the rotation about `about`, with its residual. */
static void about(const struct turn *turn, const struct hand_move *move, const float about[3], float missed, struct equation *found)
{
    memset(found, 0, sizeof *found);
    for (unsigned i = 0; i < 9; i++)
        for (unsigned a = 0; a < 3; a++) {
            found->row[HAND_MATRIX + i] += about[a] * move->motion->by_matrix[a][i];
            found->row[HAND_GRAVITY + i] += about[a] * turn->by_gravity[a][i];
        }
    found->missed = missed;
    found->variance = turn->variance + CURVED * CURVED * missed * missed * missed * missed;
}

/* Adds the two equations perpendicular to the vertical: the rotation from its computed to its true direction, with the faces'
   errors. */
static void across(const struct turn *turn, const struct hand_move *move, struct equation found[2])
{
    float missed[3], ways[2][3], aside[3], half2 = 0.0f, smallest[3] = {0};
    for (unsigned i = 0; i < 3; i++)
        half2 += 0.25f * (turn->up[i] - turn->there[i]) * (turn->up[i] - turn->there[i]);
    cross(turn->there, turn->up, missed);
    float stretched = (1.0f + half2 * (1.0f / 6.0f + half2 * 0.075f)) / __builtin_sqrtf(1.0f - half2); /* arcsine of the half */
    unsigned least = 0;
    for (unsigned i = 1; i < 3; i++)
        if (__builtin_fabsf(turn->middle[i]) < __builtin_fabsf(turn->middle[least]))
            least = i;
    smallest[least] = 1.0f;
    cross(turn->middle, smallest, ways[0]);
    unit(ways[0]);
    cross(turn->middle, ways[0], ways[1]);
    unsigned before = HAND_FACES + 2u * move->before->face, after = HAND_FACES + 2u * move->after->face;
    for (unsigned way = 0; way < 2; way++) {
        about(turn, move, ways[way], dot(ways[way], missed) * stretched, &found[way]);
        found[way].variance += 2.0f * REPEAT_RAD * REPEAT_RAD;
        cross(ways[way], turn->middle, aside);
        for (unsigned k = 0; k < 2; k++) {
            unsigned from = (move->before->face / 2u + 1u + k) % 3u, to = (move->after->face / 2u + 1u + k) % 3u;
            found[way].row[before + k] -= aside[from];
            found[way].row[after + k] += aside[0] * turn->r[0][to] + aside[1] * turn->r[1][to] + aside[2] * turn->r[2][to];
        }
    }
}

/* Adds the equation of the heading after whole revolutions. */
static void closed(const struct turn *turn, const struct hand_move *move, struct equation *found)
{
    const float *attitude = move->motion->attitude;
    float half = dot(&attitude[1], turn->middle) / attitude[0], half2 = half * half;
    float angle = 2.0f * half * (1.0f - half2 * (1.0f / 3.0f - half2 * 0.2f)) + dot(turn->corrected, turn->middle);
    about(turn, move, turn->middle, -angle, found);
    found->variance += CLOSURE_RAD * CLOSURE_RAD;
}

/* Tests a move against the present solution; `x` is relative to the centre. */
static bool fits(const struct estimate *estimate, const float x[HAND_UNKNOWNS], const struct equation *equation)
{
    float left = equation->missed;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        left -= equation->row[i] * x[i];
    return __builtin_fabsf(equation->missed) < FARTHEST &&
           left * left < TOO_FAR * (equation->variance + variance_of(estimate, equation->row));
}

bool estimate_take(struct estimate *estimate, const struct hand_move *move, bool both)
{
    struct turn turn;
    struct equation equations[3], rest;
    prepare(estimate, move, &turn);
    if (dot(turn.middle, turn.middle) < 2.0f)
        return false; /* more than a quarter revolution from its true direction */
    unit(turn.middle);
    across(&turn, move, equations);
    unsigned count = 2;
    if (move->whole)
        closed(&turn, move, &equations[count++]);
    float x[HAND_UNKNOWNS];
    solve(estimate, x);
    for (unsigned i = 0; i < count; i++)
        if (!fits(estimate, x, &equations[i]))
            return false;
    for (unsigned axis = 0; axis < 3; axis++) {
        if (both) {
            of_rest(estimate, move->before, move->noise_rad_s, axis, &rest);
            fold(estimate, &rest);
        }
        of_rest(estimate, move->after, move->noise_rad_s, axis, &rest);
        fold(estimate, &rest);
    }
    for (unsigned i = 0; i < count; i++)
        fold(estimate, &equations[i]);
    settle(estimate);
    return true;
}
