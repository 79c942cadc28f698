"""Constants of the Earth."""

import math

DEG_H = math.radians(1) / 3600  # rad/s
EARTH_RATE_RAD_S = 7.292115e-5  # WGS 84 ellipsoid
STANDARD_GRAVITY_M_S2 = 9.80665  # the unit g
MICRO_G_M_S2 = 1e-6 * STANDARD_GRAVITY_M_S2
