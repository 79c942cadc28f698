/* What the board would run without the closed form: Levenberg–Marquardt in single precision on the six parameters, with the
   exact Jacobian, normal equations scaled by their diagonal, and a Cholesky solution. For benchmarks/solving/solver_cost.py only.

   With EXACTLY_SIX it serves no other number of observations, and the compiler writes every loop out. */
#include <stdbool.h>
#include <stdint.h>

#define PARAMETERS 6u
#define LIMIT 100u

#ifdef EXACTLY_SIX
#define OBSERVATIONS(problem) 6u
#define UNROLLED_FOR(i, from, to) _Pragma("GCC unroll 6") for (unsigned i = (from); i < (to); i++)
#else
#define OBSERVATIONS(problem) ((problem)->count)
#define UNROLLED_FOR(i, from, to) for (unsigned i = (from); i < (to); i++)
#endif

/* θ = [k b]: the residuals are ω² − ‖K (m + b)‖², SIX Eqs. (2)–(4). */
struct problem {
    const float (*means_rad_s)[3];
    const float *speeds_rad_s;
    uint32_t count;
};

int levenberg_marquardt(const struct problem *problem, float tolerance, float theta[PARAMETERS]);

static float cost_of(const struct problem *problem, const float theta[PARAMETERS])
{
    float cost = 0.0f;
    UNROLLED_FOR(i, 0, OBSERVATIONS(problem)) {
        float residual = problem->speeds_rad_s[i] * problem->speeds_rad_s[i];
        UNROLLED_FOR(axis, 0, 3) {
            float turned = theta[axis] * (problem->means_rad_s[i][axis] + theta[3 + axis]);
            residual -= turned * turned;
        }
        cost += residual * residual;
    }
    return cost;
}

/* JᵀJ, its lower triangle, and Jᵀr for r = ω² − ‖K (m + b)‖² and J = ∂‖K (m + b)‖²/∂θ. */
static void linearise(const struct problem *problem, const float theta[PARAMETERS], float normal[PARAMETERS][PARAMETERS],
                      float gradient[PARAMETERS])
{
    UNROLLED_FOR(j, 0, PARAMETERS) {
        gradient[j] = 0.0f;
        UNROLLED_FOR(k, 0, j + 1)
            normal[j][k] = 0.0f;
    }
    UNROLLED_FOR(i, 0, OBSERVATIONS(problem)) {
        float residual = problem->speeds_rad_s[i] * problem->speeds_rad_s[i];
        float slope[PARAMETERS];
        UNROLLED_FOR(axis, 0, 3) {
            float shifted = problem->means_rad_s[i][axis] + theta[3 + axis];
            float turned = theta[axis] * shifted;
            residual -= turned * turned;
            slope[axis] = 2.0f * turned * shifted;
            slope[3 + axis] = 2.0f * turned * theta[axis];
        }
        UNROLLED_FOR(j, 0, PARAMETERS) {
            gradient[j] += slope[j] * residual;
            UNROLLED_FOR(k, 0, j + 1)
                normal[j][k] += slope[j] * slope[k];
        }
    }
}

/* Solves (JᵀJ + λ diag JᵀJ) step = Jᵀr; false when rounding has left the matrix not positive. */
static bool solve_step(const float normal[PARAMETERS][PARAMETERS], const float gradient[PARAMETERS], float lambda,
                       float step[PARAMETERS])
{
    float lower[PARAMETERS][PARAMETERS], inverse[PARAMETERS];
    UNROLLED_FOR(j, 0, PARAMETERS) {
        UNROLLED_FOR(k, 0, j + 1) {
            float sum = normal[j][k];
            UNROLLED_FOR(i, 0, k)
                sum -= lower[j][i] * lower[k][i];
            if (k < j) {
                lower[j][k] = sum * inverse[k];
                continue;
            }
            sum += lambda * normal[j][j];
            if (!(sum > 0.0f))
                return false;
            inverse[j] = 1.0f / __builtin_sqrtf(sum);
        }
    }
    UNROLLED_FOR(j, 0, PARAMETERS) {
        step[j] = gradient[j];
        UNROLLED_FOR(i, 0, j)
            step[j] -= lower[j][i] * step[i];
        step[j] *= inverse[j];
    }
    UNROLLED_FOR(done, 0, PARAMETERS) {
        unsigned j = PARAMETERS - 1 - done;
        UNROLLED_FOR(i, j + 1, PARAMETERS)
            step[j] -= lower[i][j] * step[i];
        step[j] *= inverse[j];
    }
    return true;
}

/* From `theta` on, until no parameter changes by more than `tolerance`. Returns the evaluations of the Jacobian. */
int levenberg_marquardt(const struct problem *problem, float tolerance, float theta[PARAMETERS])
{
    float lambda = 1e-3f;
    float cost = cost_of(problem, theta);
    for (unsigned passes = 1; passes <= LIMIT; passes++) {
        float normal[PARAMETERS][PARAMETERS], gradient[PARAMETERS];
        linearise(problem, theta, normal, gradient);
        for (;;) {
            float step[PARAMETERS], tried[PARAMETERS], largest = 0.0f;
            bool solved = solve_step(normal, gradient, lambda, step);
            for (unsigned j = 0; solved && j < PARAMETERS; j++) {
                tried[j] = theta[j] + step[j];
                float size = __builtin_fabsf(step[j]);
                largest = size > largest ? size : largest;
            }
            float tried_cost = solved ? cost_of(problem, tried) : cost;
            bool better = solved && tried_cost < cost;
            if (better || (solved && largest <= tolerance)) {
                UNROLLED_FOR(j, 0, PARAMETERS)
                    theta[j] = tried[j];
                cost = tried_cost;
                lambda *= 0.1f;
                if (largest <= tolerance)
                    return (int)passes;
                break;
            }
            lambda *= 10.0f;
            if (lambda > 1e6f)
                return -(int)passes;
        }
    }
    return -(int)LIMIT;
}
