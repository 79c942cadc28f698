"""Changes with temperature and with time: biases repeat by repeat, polynomials of temperature."""
