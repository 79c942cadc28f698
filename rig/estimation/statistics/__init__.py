"""Noise, means, coverage and variance components: statistics that any estimator may use."""
