"""External readings, whose motion a file states: solved and judged like a run."""
