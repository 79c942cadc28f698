"""The simulated hand: how somebody turns a box on a table and lays it down, and which mistakes are made with it."""
