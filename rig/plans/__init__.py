"""Procedure → steps: the motions of the arm, before it moves; pure."""
