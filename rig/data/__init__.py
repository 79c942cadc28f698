"""Data on disk: the run file, the run folder, the result."""
