"""The `world:` section: what the simulated laboratory simulates."""
