/* Scale factors and biases from averaged revolutions, in single precision and constant memory. Independent of the chip.

   Model: g = K (m + b), K = diag(k). Each revolution gives one equation, SIX Eq. (4): ω² = β0 + Σ β_s m² + Σ β_l m with β_s =
   k², β_l = 2 k² b, β0 = Σ k² b². m is the mean reading, squared afterwards. */
#ifndef SOLVER_H
#define SOLVER_H

#include <stdint.h>

#include "protocol.h"

/* Rows [1 m m² ω²] of any number of revolutions as the triangle R of their QR factorisation. Unlike normal equations it keeps
   the condition of the rows and not its square, which single precision could not represent. */
#define SOLVER_UNKNOWNS 7u
struct accumulator {
    float r[SOLVER_UNKNOWNS][SOLVER_UNKNOWNS + 1u];
    uint16_t count;
};

struct solution {
    enum solution_status status; /* unless solved, scale and bias are 0 */
    uint8_t iterations;
    float scale[3];
    float bias_rad_s[3];
};

void solver_begin(struct accumulator *accumulator);

/* Adds a revolution: mean reading and magnitude of the mean speed, rad/s, both finite. */
void solver_add(struct accumulator *accumulator, const float mean_rad_s[3], float speed_rad_s);

void solver_solve(const struct accumulator *accumulator, enum solve_method method, struct solution *solution);

#endif
