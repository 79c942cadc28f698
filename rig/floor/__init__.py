"""Several rigs at a glance: what each station tells a shared history of itself, and what the history knows today."""
