"""Every recording of a history solved again, and what that changes."""
