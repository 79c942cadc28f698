"""The rig that a command uses: its claims, its address, and the simulated laboratory."""
