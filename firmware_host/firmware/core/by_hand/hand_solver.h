/* A gyroscope's calibration from rests on six faces and moves between them, a move at a time, in single precision.

   m = F w + b + G u: reading, turn rate, bias, g-sensitivity and the vertical in the body. Sought are C = F^-1, G, b and how
   far the six faces are out of square. What is known is a triangle R and what is amiss, R x = z, x counted from a centre: the
   square root of the information (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V). Moves
   are integrated, and the equations are linear, about the centre; it moves when it is well known, and not before: a solution
   that still wanders would bend them. So no move is needed again. */
#ifndef HAND_SOLVER_H
#define HAND_SOLVER_H

#include <stdbool.h>
#include <stdint.h>

#include "hand_motion.h"

enum { HAND_MATRIX = 0, HAND_GRAVITY = 9, HAND_BIAS = 18, HAND_FACES = 21, HAND_UNKNOWNS = 33 };

struct estimate {
    float centre[HAND_UNKNOWNS]; /* C and G row by row, b, two angles of each face */
    float amiss[HAND_UNKNOWNS];  /* z */
    bool settled;                /* the centre is where the solution was after the move taken last */
    float r[HAND_UNKNOWNS * (HAND_UNKNOWNS + 1) / 2]; /* row by row, from the diagonal on */
};

/* A rest as the equations have it: on a face (0 to 5: +x -x +y -y +z -z), mean reading of so many samples. */
struct hand_rest {
    uint8_t face;
    float mean_rad_s[3];
    uint32_t samples;
};

/* A move between two rests; `whole` when its turns ended where they began. `noise_rad_s` is that of a reading. */
struct hand_move {
    const struct motion *motion;
    const struct hand_rest *before, *after;
    float noise_rad_s;
    bool whole;
};

void estimate_begin(struct estimate *estimate);

/* The vertical in the body that lies on a face, as it is known so far. */
void estimate_up(const struct estimate *estimate, uint8_t face, float up[3]);

/* Takes a move in, and of the rests beside it the one after and, where `both`, the one before. False, and nothing is
   changed, when it contradicts what is known. */
bool estimate_take(struct estimate *estimate, const struct hand_move *move, bool both);

/* What is found: as the centre has it. */
void estimate_solution(const struct estimate *estimate, float found[HAND_UNKNOWNS]);

/* The largest standard uncertainty of an element on the diagonal of C. */
float estimate_scale_std(const struct estimate *estimate);

#endif
