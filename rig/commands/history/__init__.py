"""The commands of `rig history`, and queries and entries of other commands."""
