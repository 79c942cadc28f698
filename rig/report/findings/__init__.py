"""The common form of all kinds of results, for every output of the rig, and the characteristics in entries."""
