"""The kinds of results, one file each, and the registry that every outlet walks."""
