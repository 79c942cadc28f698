"""The operator's side of a run: events, views and questions."""
