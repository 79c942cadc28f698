"""All recordings of a history solved again, and the changes of their results."""
