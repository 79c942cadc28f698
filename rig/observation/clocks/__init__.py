"""The clock of a board relative to its turner's."""
