"""A finished run in the form that a history stores: its result, rows and certificates."""
