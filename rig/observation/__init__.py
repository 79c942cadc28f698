"""Recording → averaged observations: time base, revolution, rest; pure."""
