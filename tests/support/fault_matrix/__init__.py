"""Faults at random moments of whole runs: what is broken, how a run then ended, and what of that is not as promised."""
