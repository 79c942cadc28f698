"""Estimators for external recordings only: for stated attitudes, and for bodies that are placed repeatedly."""
