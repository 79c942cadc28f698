#include "hand_solver.h"

#include <string.h>

/* Prior standard deviations: of an element of C, of G (rad/s per g: 0.1 degrees per second), of b (rad/s), of a face's error of
   squareness (0.2 degrees). */
#define MATRIX_STD 0.2f
#define GRAVITY_STD 1.75e-3f
#define BIAS_STD 1.0f
#define FACE_STD 3.5e-3f

/* Errors of hand and part, as in rig/estimation/by_hand: of a face after repositioning, of the heading after a whole revolution,
   of the angle of a move by nonlinearity and of each quarter revolution, of a rest and of a move by the Earth's rate. */
#define REPEAT_RAD 3e-4f
#define CLOSURE_RAD 3e-3f
#define NONLINEARITY 1e-4f
#define ANGLE_FRACTION 1e-4f
#define QUARTER_RAD 1.5707963f
#define EARTH_RAD_S 7e-5f
#define EARTH_MOVE_RAD_S 3e-5f

#define CURVATURE 0.02f       /* of the squared residual: the equations are linear, a rotation is not */
#define MAX_RESIDUAL_RAD 0.8f /* the largest residual of a move with any part */
#define SETTLED_STD 0.01f     /* of every element of C, below which the solution becomes the centre */
#define MAX_SQUARE 25.0f      /* of a residual, in units of its variance: 5 standard deviations */

struct equation {
    float row[HAND_UNKNOWNS];
    float residual, variance;
};

static float *get_row(struct estimate *estimate, unsigned i)
{
    return &estimate->r[i * HAND_UNKNOWNS - i * (i + 1u) / 2u]; /* an element is at its column from there */
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

static void normalise(float a[3])
{
    float inverse = 1.0f / __builtin_sqrtf(dot(a, a));
    for (unsigned i = 0; i < 3; i++)
        a[i] *= inverse;
}

static void multiply(float r[3][3], const float a[3], float product[3])
{
    for (unsigned i = 0; i < 3; i++)
        product[i] = dot(r[i], a);
}

void estimate_begin(struct estimate *estimate)
{
    memset(estimate, 0, sizeof *estimate);
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float std = i < HAND_GRAVITY ? MATRIX_STD : i < HAND_BIAS ? GRAVITY_STD : i < HAND_FACES ? BIAS_STD : FACE_STD;
        get_row(estimate, i)[i] = 1.0f / std;
    }
    for (unsigned axis = 0; axis < 3; axis++)
        estimate->centre[HAND_MATRIX + 4u * axis] = 1.0f;
}

void estimate_up(const struct estimate *estimate, uint8_t face, float up[3])
{
    const float *tilts = &estimate->centre[HAND_FACES + 2u * face];
    unsigned axis = face / 2u;
    float cosine = 1.0f - 0.5f * (tilts[0] * tilts[0] + tilts[1] * tilts[1]);
    up[axis] = face % 2u == 0 ? cosine : -cosine;
    up[(axis + 1u) % 3u] = tilts[0];
    up[(axis + 2u) % 3u] = tilts[1];
}

/* Rotates an equation into the triangle (Givens). */
static void add_equation(struct estimate *estimate, struct equation *equation)
{
    float weight = 1.0f / __builtin_sqrtf(equation->variance), residual = equation->residual * weight, *row = equation->row;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        row[i] *= weight;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float *r = get_row(estimate, i);
        if (row[i] == 0.0f)
            continue;
        float inverse = 1.0f / __builtin_sqrtf(r[i] * r[i] + row[i] * row[i]);
        float c = r[i] * inverse, s = row[i] * inverse;
        for (unsigned j = i; j < HAND_UNKNOWNS; j++) {
            float turned = c * r[j] + s * row[j];
            row[j] = c * row[j] - s * r[j];
            r[j] = turned;
        }
        float turned = c * estimate->right_side[i] + s * residual;
        residual = c * residual - s * estimate->right_side[i];
        estimate->right_side[i] = turned;
    }
}

/* x: the solution, relative to the centre. */
static void solve(const struct estimate *estimate, float x[HAND_UNKNOWNS])
{
    const float *r = &estimate->r[HAND_UNKNOWNS * (HAND_UNKNOWNS + 1u) / 2u];
    for (unsigned i = HAND_UNKNOWNS; i-- != 0;) {
        r -= HAND_UNKNOWNS - i;
        x[i] = estimate->right_side[i];
        for (unsigned j = i + 1u; j < HAND_UNKNOWNS; j++)
            x[i] -= r[j - i] * x[j];
        x[i] /= *r;
    }
}

void estimate_solution(const struct estimate *estimate, float solution[HAND_UNKNOWNS])
{
    solve(estimate, solution);
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        solution[i] += estimate->centre[i];
}

/* Returns the variance of row times the unknowns: the square of R^-T row. */
static float compute_variance(const struct estimate *estimate, const float row[HAND_UNKNOWNS])
{
    float remainder[HAND_UNKNOWNS], sum = 0.0f;
    memcpy(remainder, row, sizeof remainder);
    const float *r = estimate->r;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++) {
        float element = remainder[i] / *r;
        for (unsigned j = i; j < HAND_UNKNOWNS; j++)
            remainder[j] -= *r++ * element;
        sum += element * element;
    }
    return sum;
}

/* Returns the largest variance of every `step`th element of C. */
static float find_largest_variance(const struct estimate *estimate, unsigned step)
{
    float largest = 0.0f;
    for (unsigned i = HAND_MATRIX; i < HAND_GRAVITY; i += step) {
        float row[HAND_UNKNOWNS] = {0};
        row[i] = 1.0f;
        float variance = compute_variance(estimate, row);
        largest = variance > largest ? variance : largest;
    }
    return largest;
}

float estimate_scale_std(const struct estimate *estimate)
{
    return __builtin_sqrtf(find_largest_variance(estimate, 4));
}

static void update_centre(struct estimate *estimate)
{
    estimate->settled = find_largest_variance(estimate, 1) < SETTLED_STD * SETTLED_STD;
    if (!estimate->settled)
        return;
    estimate_solution(estimate, estimate->right_side);
    memcpy(estimate->centre, estimate->right_side, sizeof estimate->centre);
    memset(estimate->right_side, 0, sizeof estimate->right_side);
}

/* Writes the equation of a rest's mean reading on one axis: b + G u. */
static void write_rest_equation(const struct estimate *estimate, const struct hand_rest *rest, float noise_rad_s, unsigned axis,
                                struct equation *equation)
{
    float up[3];
    const float *gravity = &estimate->centre[HAND_GRAVITY + 3u * axis];
    estimate_up(estimate, rest->face, up);
    memset(equation, 0, sizeof *equation);
    memcpy(&equation->row[HAND_GRAVITY + 3u * axis], up, sizeof up);
    equation->row[HAND_BIAS + axis] = 1.0f;
    equation->residual = rest->mean_rad_s[axis] - estimate->centre[HAND_BIAS + axis] - dot(gravity, up);
    equation->variance = noise_rad_s * noise_rad_s / (float)rest->samples + EARTH_RAD_S * EARTH_RAD_S;
}

/* A move prepared for its equations: its rotation by the present solution, and its derivatives. */
struct turn {
    float up[3];         /* the vertical before, in the body before the move */
    float rotated_up[3]; /* the vertical after, rotated back into the body before: it should equal `up` */
    float middle[3];     /* between the two */
    float r[3][3];       /* body after to body before */
    float gravity_jacobian[3][9];
    float corrected[3];  /* for the derivative of the bias, and G */
    float variance;      /* without those of its ends and of its curvature */
};

/* The bias is the mean of the two rests: it includes G u of both, but not the change of u(t) during the move. */
static void prepare(const struct estimate *estimate, const struct hand_move *move, struct turn *turn)
{
    const struct motion *motion = move->motion;
    const float *matrix = &estimate->centre[HAND_MATRIX], *gravity = &estimate->centre[HAND_GRAVITY];
    float after[3], mean_up[3], bias_jacobian[3];
    estimate_up(estimate, move->before->face, turn->up);
    estimate_up(estimate, move->after->face, after);
    motion_attitude(motion->attitude, turn->r);
    for (unsigned c = 0; c < 3; c++)
        mean_up[c] = 0.5f * (turn->up[c] + after[c]);
    for (unsigned a = 0; a < 3; a++) {
        turn->corrected[a] = 0.0f;
        for (unsigned i = 0; i < 3; i++) {
            bias_jacobian[i] = motion->attitude_integral[a][0] * matrix[i] + motion->attitude_integral[a][1] * matrix[3 + i] +
                               motion->attitude_integral[a][2] * matrix[6 + i];
            turn->corrected[a] -= 0.5f * bias_jacobian[i] * (move->after->mean_rad_s[i] - move->before->mean_rad_s[i]);
            for (unsigned c = 0; c < 3; c++) {
                const float *vertical = &motion->vertical_integral[a][c];
                float derivative = bias_jacobian[i] * mean_up[c] - vertical[0] * matrix[i] - vertical[3] * matrix[3 + i] -
                                   vertical[6] * matrix[6 + i];
                turn->gravity_jacobian[a][3 * i + c] = derivative;
                turn->corrected[a] += derivative * gravity[3 * i + c];
            }
        }
    }
    float perpendicular[3];
    multiply(turn->r, after, turn->rotated_up);
    cross(turn->corrected, turn->rotated_up, perpendicular);
    for (unsigned i = 0; i < 3; i++) {
        turn->rotated_up[i] += perpendicular[i];
        turn->middle[i] = turn->rotated_up[i] + turn->up[i];
    }
    float path = motion->path_rad, duration_s = motion->duration_s, noise2 = move->noise_rad_s * move->noise_rad_s;
    float samples = 1.0f / (float)motion->samples + 0.25f / (float)move->before->samples + 0.25f / (float)move->after->samples;
    turn->variance = duration_s * duration_s * (noise2 * samples + EARTH_MOVE_RAD_S * EARTH_MOVE_RAD_S) +
                     path * (NONLINEARITY * NONLINEARITY * path + ANGLE_FRACTION * ANGLE_FRACTION * QUARTER_RAD);
}

/* Writes the equation of the rotation about `axis`, with its residual. */
static void write_rotation_equation(const struct turn *turn, const struct hand_move *move, const float axis[3], float residual,
                                    struct equation *equation)
{
    memset(equation, 0, sizeof *equation);
    for (unsigned i = 0; i < 9; i++)
        for (unsigned a = 0; a < 3; a++) {
            equation->row[HAND_MATRIX + i] += axis[a] * move->motion->matrix_jacobian[a][i];
            equation->row[HAND_GRAVITY + i] += axis[a] * turn->gravity_jacobian[a][i];
        }
    equation->residual = residual;
    equation->variance = turn->variance + CURVATURE * CURVATURE * residual * residual * residual * residual;
}

/* Writes the two equations perpendicular to the vertical: the rotation from its computed to its true direction, with the faces'
   errors. */
static void write_tilt_equations(const struct turn *turn, const struct hand_move *move, struct equation equations[2])
{
    float mismatch[3], directions[2][3], perpendicular[3], half2 = 0.0f, smallest[3] = {0};
    for (unsigned i = 0; i < 3; i++)
        half2 += 0.25f * (turn->up[i] - turn->rotated_up[i]) * (turn->up[i] - turn->rotated_up[i]);
    cross(turn->rotated_up, turn->up, mismatch);
    float arcsine_ratio = (1.0f + half2 * (1.0f / 6.0f + half2 * 0.075f)) / __builtin_sqrtf(1.0f - half2); /* arcsine of the half */
    unsigned least = 0;
    for (unsigned i = 1; i < 3; i++)
        if (__builtin_fabsf(turn->middle[i]) < __builtin_fabsf(turn->middle[least]))
            least = i;
    smallest[least] = 1.0f;
    cross(turn->middle, smallest, directions[0]);
    normalise(directions[0]);
    cross(turn->middle, directions[0], directions[1]);
    unsigned before = HAND_FACES + 2u * move->before->face, after = HAND_FACES + 2u * move->after->face;
    for (unsigned k = 0; k < 2; k++) {
        write_rotation_equation(turn, move, directions[k], dot(directions[k], mismatch) * arcsine_ratio, &equations[k]);
        equations[k].variance += 2.0f * REPEAT_RAD * REPEAT_RAD;
        cross(directions[k], turn->middle, perpendicular);
        for (unsigned angle = 0; angle < 2; angle++) {
            unsigned from = (move->before->face / 2u + 1u + angle) % 3u, to = (move->after->face / 2u + 1u + angle) % 3u;
            equations[k].row[before + angle] -= perpendicular[from];
            equations[k].row[after + angle] +=
                perpendicular[0] * turn->r[0][to] + perpendicular[1] * turn->r[1][to] + perpendicular[2] * turn->r[2][to];
        }
    }
}

/* Writes the equation of the heading after whole revolutions. */
static void write_heading_equation(const struct turn *turn, const struct hand_move *move, struct equation *equation)
{
    const float *attitude = move->motion->attitude;
    float half = dot(&attitude[1], turn->middle) / attitude[0], half2 = half * half;
    float angle = 2.0f * half * (1.0f - half2 * (1.0f / 3.0f - half2 * 0.2f)) + dot(turn->corrected, turn->middle);
    write_rotation_equation(turn, move, turn->middle, -angle, equation);
    equation->variance += CLOSURE_RAD * CLOSURE_RAD;
}

/* Tests a move against the present solution; `x` is relative to the centre. */
static bool fits(const struct estimate *estimate, const float x[HAND_UNKNOWNS], const struct equation *equation)
{
    float residual = equation->residual;
    for (unsigned i = 0; i < HAND_UNKNOWNS; i++)
        residual -= equation->row[i] * x[i];
    return __builtin_fabsf(equation->residual) < MAX_RESIDUAL_RAD &&
           residual * residual < MAX_SQUARE * (equation->variance + compute_variance(estimate, equation->row));
}

bool estimate_take(struct estimate *estimate, const struct hand_move *move, bool both)
{
    struct turn turn;
    struct equation equations[3], rest;
    prepare(estimate, move, &turn);
    if (dot(turn.middle, turn.middle) < 2.0f)
        return false; /* more than a quarter revolution from its true direction */
    normalise(turn.middle);
    write_tilt_equations(&turn, move, equations);
    unsigned count = 2;
    if (move->whole)
        write_heading_equation(&turn, move, &equations[count++]);
    float x[HAND_UNKNOWNS];
    solve(estimate, x);
    for (unsigned i = 0; i < count; i++)
        if (!fits(estimate, x, &equations[i]))
            return false;
    for (unsigned axis = 0; axis < 3; axis++) {
        if (both) {
            write_rest_equation(estimate, move->before, move->noise_rad_s, axis, &rest);
            add_equation(estimate, &rest);
        }
        write_rest_equation(estimate, move->after, move->noise_rad_s, axis, &rest);
        add_equation(estimate, &rest);
    }
    for (unsigned i = 0; i < count; i++)
        add_equation(estimate, &equations[i]);
    update_centre(estimate);
    return true;
}
