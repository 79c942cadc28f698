"""Faults at random moments of whole runs: the faults, the runs' ends, and the deviations from the promises."""
