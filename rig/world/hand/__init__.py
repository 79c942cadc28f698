"""The simulated hand: how a person turns a box on a table and lays it down, with that person's mistakes."""
