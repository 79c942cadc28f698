"""The recomputation of all recordings of a history, and the changes of their results."""
