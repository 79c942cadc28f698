"""Numbers and findings in words for all outputs: rounding, checks, glossary."""
