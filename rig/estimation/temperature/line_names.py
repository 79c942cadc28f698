"""The names of the contributors to the uncertainty of polynomials over temperature, which reports use as well."""

NOISE, ORDER, LAG = "noise and bias drift", "order of the polynomials", "thermometer's lag"
HYSTERESIS, GRADIENT = "warming against cooling", "temperature gradient"
