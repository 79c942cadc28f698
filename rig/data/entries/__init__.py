"""What `result.json` says of each kind of result."""
