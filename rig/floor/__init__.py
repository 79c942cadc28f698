"""Several rigs at a glance: the present state of each station in a shared history, and today's calibrations."""
