#include "solver.h"

#include <stdbool.h>
#include <string.h>

#define PARAMETERS 6u
#define SPEED SOLVER_UNKNOWNS /* the column of ω² */

/* The host refuses designs whose condition number is above 30. What is_well_conditioned() estimates is then at most 30 √13.5:
   what the host accepts is solved here too. A missing direction of rotation gives hundreds. */
#define MAX_CONDITION 115.0f

#define NEWTON_LIMIT 20u
#define NEWTON_TOLERANCE 1e-4f /* of ω²: a step this small leaves an error of its square */
#define ALGORITHM_1_LIMIT 255u
#define ALGORITHM_1_TOLERANCE 2e-6f /* of Σ|β|: SIX has 1e-6, absolute, which single precision does not always resolve */

/* Unrolled by the compiler, and small functions inlined: counting and indexing would be two thirds of all instructions. */
#define UNROLLED_FOR(i, from, to) _Pragma("GCC unroll 6") for (unsigned i = (from); i < (to); i++)

/* X β = ω² − γ for γ as yet unknown. X has the columns [m m²] and is given by its triangle, in blocks of three: [linear mixed;
   0 squares]. The right-hand sides ω² and 1 are rotated alike. */
struct design {
    float linear[3][3], mixed[3][3], squares[3][3];
    float speeds[PARAMETERS], ones[PARAMETERS];
    float centre[3]; /* origin of the readings, rad/s */
};

void solver_begin(struct accumulator *accumulator)
{
    memset(accumulator, 0, sizeof *accumulator);
}

struct rotation {
    float c, s;
};

/* Returns the Givens rotation of `b` into `a`; the identity if both are negligible in single precision. */
static struct rotation compute_rotation(float a, float b)
{
    float square = a * a + b * b;
    if (square < 1e-30f)
        return (struct rotation){1.0f, 0.0f};
    float inverse = 1.0f / __builtin_sqrtf(square);
    return (struct rotation){a * inverse, b * inverse};
}

static void rotate(struct rotation rotation, float *a, float *b)
{
    float turned = rotation.c * *a + rotation.s * *b;
    *b = rotation.c * *b - rotation.s * *a;
    *a = turned;
}

void solver_add(struct accumulator *accumulator, const float mean_rad_s[3], float speed_rad_s)
{
    float row[SOLVER_UNKNOWNS + 1u] = {[0] = 1.0f, [SPEED] = speed_rad_s * speed_rad_s};
    for (unsigned axis = 0; axis < 3; axis++) {
        row[1 + axis] = mean_rad_s[axis];
        row[4 + axis] = mean_rad_s[axis] * mean_rad_s[axis];
    }
    for (unsigned i = 0; i < SOLVER_UNKNOWNS; i++) {
        struct rotation rotation = compute_rotation(accumulator->r[i][i], row[i]);
        for (unsigned j = i; j <= SPEED; j++)
            rotate(rotation, &accumulator->r[i][j], &row[j]);
    }
    accumulator->count++;
}

/* Makes [m m²] out of [1 m m²]: the first row of R joins the others as one more revolution. Its linear terms, for readings
   counted from their mean, are zero; that also decouples 1 from m, so moving the origin leaves R a triangle. */
static void reduce(const struct accumulator *accumulator, bool centred, struct design *design)
{
    const float(*r)[SOLVER_UNKNOWNS + 1u] = accumulator->r;
    float linear[3], squares[3], speed = r[0][SPEED], one = r[0][0], inverse = 1.0f / one;
    UNROLLED_FOR(k, 0, 3) {
        design->centre[k] = centred ? r[0][1 + k] * inverse : 0.0f;
        linear[k] = r[0][1 + k];
        squares[k] = r[0][4 + k] - design->centre[k] * r[0][1 + k];
        design->speeds[k] = r[1 + k][SPEED];
        design->speeds[3 + k] = r[4 + k][SPEED];
        design->ones[k] = design->ones[3 + k] = 0.0f;
    }
    UNROLLED_FOR(i, 0, 3) {
        UNROLLED_FOR(k, i, 3) {
            design->linear[i][k] = r[1 + i][1 + k];
            design->squares[i][k] = r[4 + i][4 + k];
        }
        UNROLLED_FOR(k, 0, 3)
            design->mixed[i][k] = r[1 + i][4 + k] - (k < i ? 0.0f : 2.0f * design->centre[k] * r[1 + i][1 + k]);
    }
    if (!centred)
        UNROLLED_FOR(i, 0, 3) {
            struct rotation rotation = compute_rotation(design->linear[i][i], linear[i]);
            UNROLLED_FOR(k, i, 3)
                rotate(rotation, &design->linear[i][k], &linear[k]);
            UNROLLED_FOR(k, 0, 3)
                rotate(rotation, &design->mixed[i][k], &squares[k]);
            rotate(rotation, &design->speeds[i], &speed);
            rotate(rotation, &design->ones[i], &one);
        }
    UNROLLED_FOR(i, 0, 3) {
        struct rotation rotation = compute_rotation(design->squares[i][i], squares[i]);
        UNROLLED_FOR(k, i, 3)
            rotate(rotation, &design->squares[i][k], &squares[k]);
        rotate(rotation, &design->speeds[3 + i], &speed);
        rotate(rotation, &design->ones[3 + i], &one);
    }
}

/* Inverts a triangle in place. */
static inline void invert(float r[3][3])
{
    UNROLLED_FOR(i, 0, 3)
        r[i][i] = 1.0f / r[i][i];
    float r01 = -r[0][0] * r[0][1] * r[1][1];
    r[0][2] = -(r[0][0] * r[0][2] + r01 * r[1][2]) * r[2][2];
    r[1][2] *= -r[1][1] * r[2][2];
    r[0][1] = r01;
}

static inline float compute_norm2(float r[3][3])
{
    float sum = 0.0f;
    UNROLLED_FOR(i, 0, 3)
        UNROLLED_FOR(k, i, 3)
            sum += r[i][k] * r[i][k];
    return sum;
}

/* Returns whether the revolutions identify all six parameters, from the inverses of the design's two triangles. Readings are
   measured in their own RMS length, so that squares and linear terms compare and X is about √(2 N) long. `mixed`, whose columns
   are no longer than that, does not make X singular. Beyond MAX_SCALE the revolutions are all alike: only noise is left to
   compare. NaN is refused too. */
static inline bool is_well_conditioned(struct design *inverted, float length2, uint16_t count, float speed2)
{
    if (!(length2 < MAX_SCALE * MAX_SCALE * speed2 && speed2 < MAX_SCALE * MAX_SCALE * length2))
        return false;
    float inverse2 = length2 * (compute_norm2(inverted->linear) + length2 * compute_norm2(inverted->squares));
    return 2.0f * count * inverse2 <= MAX_CONDITION * MAX_CONDITION;
}

/* β(γ) = p − γ q, with the squares last: p solves X p = ω², q solves X q = 1. */
struct line {
    float p[PARAMETERS], q[PARAMETERS];
};

static inline void solve_for(const struct design *inverted, const float right_side[PARAMETERS], float solution[PARAMETERS])
{
    float remainder[3];
    UNROLLED_FOR(i, 0, 3) {
        solution[3 + i] = 0.0f;
        UNROLLED_FOR(k, i, 3)
            solution[3 + i] += inverted->squares[i][k] * right_side[3 + k];
    }
    UNROLLED_FOR(i, 0, 3) {
        remainder[i] = right_side[i];
        UNROLLED_FOR(k, 0, 3)
            remainder[i] -= inverted->mixed[i][k] * solution[3 + k];
    }
    UNROLLED_FOR(i, 0, 3) {
        solution[i] = 0.0f;
        UNROLLED_FOR(k, i, 3)
            solution[i] += inverted->linear[i][k] * remainder[k];
    }
}

static void compute_beta(const struct line *line, float gamma, float beta[PARAMETERS])
{
    UNROLLED_FOR(i, 0, PARAMETERS)
        beta[i] = line->p[i] - gamma * line->q[i];
}

/* Γ(β) = Σ β_l² / (4 β_s), which must equal β0. */
static float compute_gamma(const float beta[PARAMETERS])
{
    float gamma = 0.0f;
    UNROLLED_FOR(axis, 0, 3)
        gamma += beta[axis] * beta[axis] / (4.0f * beta[3 + axis]);
    return gamma;
}

/* Newton on γ = Γ(β(γ)), from the closed form for one speed, which is exact when all speeds are equal. */
static inline enum solution_status solve_by_newton(const struct line *line, float speed2, float beta[PARAMETERS], uint8_t *steps)
{
    float g = compute_gamma(line->q);
    float gamma = speed2 * g / (1.0f + g);
    for (*steps = 1; *steps <= NEWTON_LIMIT; ++*steps) {
        float value = -gamma, slope = -1.0f;
        compute_beta(line, gamma, beta);
        UNROLLED_FOR(axis, 0, 3) {
            float bias = beta[axis] / (2.0f * beta[3 + axis]);
            value += beta[3 + axis] * bias * bias;
            slope += bias * (bias * line->q[3 + axis] - line->q[axis]);
        }
        float step = value / slope;
        gamma -= step;
        compute_beta(line, gamma, beta);
        if (__builtin_fabsf(step) <= NEWTON_TOLERANCE * speed2)
            return SOLUTION_SOLVED;
    }
    return SOLUTION_NOT_CONVERGED;
}

/* SIX, Algorithm 1, as published: γ ← Γ(β), β ← β(γ), from γ = 0, until β converges. Each pass changes β by β0 / (ω² − β0)
   times what the pass before did, so it diverges when β0 > ω²/2. Compared with the first change, not with the last: in a slow
   convergence two neighbours differ by less than rounding. */
static enum solution_status solve_by_algorithm_1(const struct line *line, float beta[PARAMETERS], uint8_t *passes)
{
    float first_change = __builtin_inff();
    compute_beta(line, 0.0f, beta);
    for (*passes = 2; *passes < ALGORITHM_1_LIMIT; ++*passes) {
        float improved[PARAMETERS], change = 0.0f, size = 0.0f;
        compute_beta(line, compute_gamma(beta), improved);
        UNROLLED_FOR(i, 0, PARAMETERS) {
            change += __builtin_fabsf(improved[i] - beta[i]);
            size += __builtin_fabsf(improved[i]);
        }
        memcpy(beta, improved, sizeof improved);
        if (change <= ALGORITHM_1_TOLERANCE * size)
            return SOLUTION_SOLVED;
        if (!(change < first_change))
            break;
        if (*passes == 2)
            first_change = change;
    }
    return SOLUTION_NOT_CONVERGED;
}

/* k = √β_s and b = β_l / (2 β_s), the last lines of Algorithm 1; false when a square is not one. */
static bool compute_parameters(const float beta[PARAMETERS], const float centre[3], struct solution *solution)
{
    UNROLLED_FOR(axis, 0, 3) {
        if (!(beta[3 + axis] > 0.0f))
            return false;
        solution->scale[axis] = __builtin_sqrtf(beta[3 + axis]);
        solution->bias_rad_s[axis] = beta[axis] / (2.0f * beta[3 + axis]) - centre[axis];
    }
    return true;
}

static enum solution_status solve(const struct accumulator *accumulator, enum solve_method method, struct solution *solution)
{
    struct design design;
    struct line line;
    float beta[PARAMETERS];
    if (accumulator->count < PARAMETERS)
        return SOLUTION_TOO_FEW_OBSERVATIONS;
    float speed2 = accumulator->r[0][SPEED] / accumulator->r[0][0]; /* the mean of ω² */
    reduce(accumulator, true, &design);
    float length2 = compute_norm2(design.linear) / accumulator->count;
    invert(design.linear);
    invert(design.squares);
    if (!is_well_conditioned(&design, length2, accumulator->count, speed2))
        return SOLUTION_DEGENERATE;
    if (method == METHOD_ALGORITHM_1) { /* counts readings from zero, as published */
        reduce(accumulator, false, &design);
        invert(design.linear);
        invert(design.squares);
    }
    solve_for(&design, design.speeds, line.p);
    solve_for(&design, design.ones, line.q);
    enum solution_status status = method == METHOD_ALGORITHM_1
                                      ? solve_by_algorithm_1(&line, beta, &solution->iterations)
                                      : solve_by_newton(&line, speed2, beta, &solution->iterations);
    if (status == SOLUTION_SOLVED && !compute_parameters(beta, design.centre, solution))
        return SOLUTION_DEGENERATE;
    return status;
}

void solver_solve(const struct accumulator *accumulator, enum solve_method method, struct solution *solution)
{
    memset(solution, 0, sizeof *solution);
    enum solution_status status = solve(accumulator, method, solution);
    if (status != SOLUTION_SOLVED)
        memset(solution, 0, sizeof *solution);
    solution->status = status;
}
