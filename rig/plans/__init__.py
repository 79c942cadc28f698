"""Procedure → steps: what the arm will do, before it does it; pure."""
