"""The motion of turners of all kinds: joints, geometry, steps, limits, clearances."""
