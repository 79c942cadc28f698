"""Constants of the Earth."""

EARTH_RATE_RAD_S = 7.292115e-5  # of the WGS 84 ellipsoid
STANDARD_GRAVITY_M_S2 = 9.80665  # of the unit g
MICRO_G_M_S2 = 1e-6 * STANDARD_GRAVITY_M_S2
