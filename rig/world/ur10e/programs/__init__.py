"""Programs that the simulated controller runs: URScript, and what ur_rtde uploads."""
