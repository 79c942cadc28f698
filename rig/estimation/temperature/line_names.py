"""The names of the contributors to the uncertainty of polynomials over temperature, also for those who print them."""

NOISE, ORDER, LAG = "noise and bias drift", "order of the polynomials", "thermometer's lag"
HYSTERESIS, GRADIENT = "warming against cooling", "temperature gradient"
