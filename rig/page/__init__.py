"""The operator's page: a run in a browser, as it goes on or replayed. It listens; it moves nothing."""
