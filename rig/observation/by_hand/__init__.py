"""A body that is moved by hand: its rests, and the moves in between."""
