"""Whether a recording agrees with itself: fault modes, residual tests, and the checks that are made of them."""
