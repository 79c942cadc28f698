"""Readings recorded elsewhere, whose motion a file states: solved and judged as a run is."""
