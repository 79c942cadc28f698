"""The sensors on the board's bus, at their registers."""
