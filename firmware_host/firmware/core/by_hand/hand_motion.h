/* The rotation of a body in a move by hand and its derivatives with respect to the unknowns, one reading after another. */
#ifndef HAND_MOTION_H
#define HAND_MOTION_H

#include <stdint.h>

struct motion {
    float attitude[4];             /* quaternion, real part first: body now to body at the start */
    float matrix_jacobian[3][9];   /* derivative of the rotation, a vector in the body at the start, by the matrix C, row by row */
    float attitude_integral[3][3]; /* integral of the attitude R */
    float vertical_integral[3][9]; /* integral of R times the vertical in the body: R(a, s) u(c) at [a][3 s + c] */
    float rotation_rad[3];         /* integral of the angular rate in the body */
    float path_rad, duration_s;
    uint32_t samples;
};

void motion_begin(struct motion *motion);

/* Adds `samples` readings m - b, whose mean is `rate`, over `dt_s`: the angular rate is C (m - b). `up` is the vertical in the
   body at the start. */
void motion_add(struct motion *motion, const float matrix[9], const float up[3], const float rate[3], float dt_s, unsigned samples);

/* Writes the attitude as a matrix, row by row. */
void motion_attitude(const float attitude[4], float r[3][3]);

#endif
