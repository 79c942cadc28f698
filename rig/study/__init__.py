"""Monte-Carlo studies: the papers' figures and tables, computed with the rig's own estimators."""
