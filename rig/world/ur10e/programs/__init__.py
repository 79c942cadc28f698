"""Programs of the simulated controller: URScript, and the one that ur_rtde uploads."""
