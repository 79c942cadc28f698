"""Planning: the functions that turn a procedure into the steps of the arm, before it moves."""
