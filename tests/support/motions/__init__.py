"""What sensors read while an arm, a servo or a table turns them, computed."""
