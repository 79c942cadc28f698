"""The kinds of results, a file each, and the registry that every outlet walks."""
