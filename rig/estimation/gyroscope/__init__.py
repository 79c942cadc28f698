"""Gyroscopes: the six-observation and the vector model, turns, increments, the Earth's rate and their budgets."""
