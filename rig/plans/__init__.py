"""From a procedure to steps: the motions of the arm, before it moves. Pure."""
