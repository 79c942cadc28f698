"""Estimators for external recordings only: attitudes that a reference states, and bodies that are placed repeatedly."""
