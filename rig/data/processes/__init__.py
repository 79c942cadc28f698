"""Foreign files, read in a process of its own, and the signals that end processes."""
