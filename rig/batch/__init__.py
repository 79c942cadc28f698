"""A series of parts: their states, the questions between their runs, and the documents."""
