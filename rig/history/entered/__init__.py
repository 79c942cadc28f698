"""A finished run as a history keeps it: its result, its rows, its certificates."""
