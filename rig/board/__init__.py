"""The rig's side of the board: is it what the configuration says, and what it has stored."""
