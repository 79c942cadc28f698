"""The operator's page: a run in a browser, live or replayed. It moves nothing."""
