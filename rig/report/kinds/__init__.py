"""The kinds of results, one file each, and their registry, which every output uses."""
