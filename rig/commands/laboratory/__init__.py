"""The rig that a command works with: its claims, its address, and the simulated laboratory."""
