"""Entries of `result.json`, made from what the analysis found."""
