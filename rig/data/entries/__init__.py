"""The entries of `result.json`, by kind of result."""
