"""Entries of `result.json`, built from results of the analysis."""
