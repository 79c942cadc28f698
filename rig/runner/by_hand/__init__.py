"""Sessions by hand while they happen, solved by the host or by the board."""
