"""Parts of a recording that checks compare: segments, transfers, halves of dwells, raw readings."""
