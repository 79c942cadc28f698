/* A gyroscope's calibration from rests on six faces and moves between them, a move at a time, in single precision.

   m = F w + b + G u: reading, turn rate, bias, g-sensitivity and the vertical in the body. The unknowns are C = F^-1, G, b and
   the six faces' errors of squareness. The solution is a triangle R with a right-hand side z, R x = z, x relative to a centre:
   a square-root information filter (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V). Moves
   are integrated, and the equations linearized, about the centre. It follows the solution only once that is accurate, because
   an early one would change the linearization. So no move has to be stored. */
#ifndef HAND_SOLVER_H
#define HAND_SOLVER_H

#include <stdbool.h>
#include <stdint.h>

#include "hand_motion.h"

enum { HAND_MATRIX = 0, HAND_GRAVITY = 9, HAND_BIAS = 18, HAND_FACES = 21, HAND_UNKNOWNS = 33 };

struct estimate {
    float centre[HAND_UNKNOWNS]; /* C and G row by row, b, two angles of each face */
    float right_side[HAND_UNKNOWNS]; /* z */
    bool settled; /* the centre equals the solution after the last accepted move */
    float r[HAND_UNKNOWNS * (HAND_UNKNOWNS + 1) / 2]; /* row by row, from the diagonal on */
};

/* A rest in the equations: its face (0 to 5: +x -x +y -y +z -z), and the mean reading of its samples. */
struct hand_rest {
    uint8_t face;
    float mean_rad_s[3];
    uint32_t samples;
};

/* A move between two rests; `whole` if it is of whole revolutions. `noise_rad_s` is that of a reading. */
struct hand_move {
    const struct motion *motion;
    const struct hand_rest *before, *after;
    float noise_rad_s;
    bool whole;
};

void estimate_begin(struct estimate *estimate);

/* Writes the vertical in the body on a face, by the present solution. */
void estimate_up(const struct estimate *estimate, uint8_t face, float up[3]);

/* Adds a move and the rest after it, with `both` also the rest before it. False, without a change, if it contradicts the
   solution. */
bool estimate_take(struct estimate *estimate, const struct hand_move *move, bool both);

/* Writes the solution in the form of the centre. */
void estimate_solution(const struct estimate *estimate, float found[HAND_UNKNOWNS]);

/* Returns the largest standard uncertainty of an element on the diagonal of C. */
float estimate_scale_std(const struct estimate *estimate);

#endif
