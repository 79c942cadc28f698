"""The motion of a turner, of whatever kind: joints, geometry, steps, limits, clearances."""
