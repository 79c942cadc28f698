"""A run in progress: the only impure code between pure functions and devices."""
