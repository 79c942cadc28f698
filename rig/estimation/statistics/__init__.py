"""Noise, means, coverage and variance components: statistics for all estimators."""
