"""The motion of turners (arms, rate tables, servos): joints, geometry, steps, limits, clearances."""
