"""A gyroscope calibrated by hand: a body that is turned on a table and lies still in between, as a graph."""
