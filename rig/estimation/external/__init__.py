"""Estimators for external recordings only: by stated attitudes, and of bodies that are placed repeatedly."""
