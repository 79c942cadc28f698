"""The simulated KVH 1775: its answers to bytes, on its own serial line."""
