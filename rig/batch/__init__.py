"""A series of parts, one after the other: what has become of each, what is asked between two, and what it leaves."""
