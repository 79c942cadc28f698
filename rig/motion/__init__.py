"""The motion of turners, that is, of arms, rate tables and servos: joints, geometry, steps, limits, clearances."""
