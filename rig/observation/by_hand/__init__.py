"""A body moved by hand: its rests, and the moves in between."""
