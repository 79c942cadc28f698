"""A body that a hand moves: when it lay still, and the moves in between."""
