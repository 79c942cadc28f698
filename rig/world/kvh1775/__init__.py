"""The simulated KVH 1775: what the instrument does with bytes, on a serial line of its own."""
