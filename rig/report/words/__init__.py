"""Numbers and findings in words, the same at every outlet: rounding, checks, glossary."""
