"""Monte-Carlo studies: the papers' figures and tables, made with the rig's own estimators."""
