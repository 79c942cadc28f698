"""The simulated laboratory, in a process of its own at the far end of the wire."""
