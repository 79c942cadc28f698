"""What checks compare within a recording: segments, transfers, halves of dwells, readings as they were recorded."""
