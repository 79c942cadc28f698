"""A series of parts, one after the other: their states, the questions in between, and the documents."""
