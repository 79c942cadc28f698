"""Extensions as a user's own packages add them: a kind of sensor, a turner."""
