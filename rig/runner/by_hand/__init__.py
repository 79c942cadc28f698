"""Sessions by hand while they happen. The host or the board solves them."""
