"""The sensors on the board's bus, at register level."""
