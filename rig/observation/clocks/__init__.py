"""The clock of a board relative to the clock of the turner: the arm, rate table or servo that turns the board."""
