"""Numbers and findings in words for all outlets: rounding, checks, glossary."""
