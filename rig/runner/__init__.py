"""A run while it happens: the only impure middle."""
