#include "hand_motion.h"

#include <string.h>

#define UNROLLED_FOR(i, from, to) _Pragma("GCC unroll 9") for (unsigned i = (from); i < (to); i++)

void motion_begin(struct motion *motion)
{
    memset(motion, 0, sizeof *motion);
    motion->attitude[0] = 1.0f;
}

void motion_attitude(const float attitude[4], float r[3][3])
{
    float w = attitude[0], x = attitude[1], y = attitude[2], z = attitude[3];
    r[0][0] = 1.0f - 2.0f * (y * y + z * z);
    r[1][1] = 1.0f - 2.0f * (x * x + z * z);
    r[2][2] = 1.0f - 2.0f * (x * x + y * y);
    r[0][1] = 2.0f * (x * y - w * z);
    r[1][0] = 2.0f * (x * y + w * z);
    r[0][2] = 2.0f * (x * z + w * y);
    r[2][0] = 2.0f * (x * z - w * y);
    r[1][2] = 2.0f * (y * z - w * x);
    r[2][1] = 2.0f * (y * z + w * x);
}

/* q becomes q p. One step of Newton's method corrects its length, which would drift by rounding. */
static void multiply(float q[4], const float p[4])
{
    float w = q[0] * p[0] - q[1] * p[1] - q[2] * p[2] - q[3] * p[3];
    float x = q[0] * p[1] + q[1] * p[0] + q[2] * p[3] - q[3] * p[2];
    float y = q[0] * p[2] - q[1] * p[3] + q[2] * p[0] + q[3] * p[1];
    float z = q[0] * p[3] + q[1] * p[2] - q[2] * p[1] + q[3] * p[0];
    float length = 1.5f - 0.5f * (w * w + x * x + y * y + z * z);
    q[0] = w * length;
    q[1] = x * length;
    q[2] = y * length;
    q[3] = z * length;
}

/* The rate counts as constant over dt. As a move begins and ends at rest, the time of the reading within dt does not matter.
   Integrands are evaluated in the middle of the step. */
void motion_add(struct motion *motion, const float matrix[9], const float up[3], const float rate[3], float dt_s, unsigned samples)
{
    float step[3], square = 0.0f;
    UNROLLED_FOR(i, 0, 3) {
        step[i] = (matrix[3 * i] * rate[0] + matrix[3 * i + 1] * rate[1] + matrix[3 * i + 2] * rate[2]) * dt_s;
        square += step[i] * step[i];
        motion->rotation_rad[i] += step[i];
    }
    motion->path_rad += __builtin_sqrtf(square);
    motion->duration_s += dt_s;
    motion->samples += samples;

    float s = square / 16.0f, half = 0.25f * (1.0f - s / 6.0f); /* half of the step's half angle */
    float half_step[4] = {1.0f - s * (0.5f - s / 24.0f), half * step[0], half * step[1], half * step[2]};
    float r[3][3], vertical[3];
    multiply(motion->attitude, half_step);
    motion_attitude(motion->attitude, r);
    multiply(motion->attitude, half_step);

    UNROLLED_FOR(c, 0, 3)
        vertical[c] = r[0][c] * up[0] + r[1][c] * up[1] + r[2][c] * up[2];
    UNROLLED_FOR(a, 0, 3)
        UNROLLED_FOR(i, 0, 3) {
            float attitude_dt = r[a][i] * dt_s;
            motion->attitude_integral[a][i] += attitude_dt;
            UNROLLED_FOR(c, 0, 3) {
                motion->matrix_jacobian[a][3 * i + c] += attitude_dt * rate[c];
                motion->vertical_integral[a][3 * i + c] += attitude_dt * vertical[c];
            }
        }
}
