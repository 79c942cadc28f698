"""A finished run in the form of a history: its result, its rows, its certificates."""
