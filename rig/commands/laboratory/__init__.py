"""The rig of a command: its claims, its address, and the simulated laboratory."""
