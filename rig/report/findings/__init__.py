"""The interface of kinds of results to all outlets, and the characteristics in entries."""
