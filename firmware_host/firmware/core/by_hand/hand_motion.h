/* How a body has turned in a move by hand, and how that changes with what is sought: one reading after another. */
#ifndef HAND_MOTION_H
#define HAND_MOTION_H

#include <stdint.h>

struct motion {
    float attitude[4];     /* quaternion, real part first: body now to body at the start */
    float by_matrix[3][9]; /* how the turn, a vector in the body at the start, changes with the matrix C, row by row */
    float turned[3][3];    /* integral of the attitude R */
    float along[3][9];     /* integral of R times the vertical in the body: R(a, s) u(c) at [a][3 s + c] */
    float swept[3];        /* integral of the turn rate in the body */
    float path_rad, duration_s;
    uint32_t samples;
};

void motion_begin(struct motion *motion);

/* Takes `samples` readings m - b, whose mean is `rate`, over `dt_s`: it turns by C (m - b). `up` is the vertical in the body
   at the start. */
void motion_add(struct motion *motion, const float matrix[9], const float up[3], const float rate[3], float dt_s, unsigned samples);

/* The attitude as a matrix, row by row. */
void motion_attitude(const float attitude[4], float r[3][3]);

#endif
