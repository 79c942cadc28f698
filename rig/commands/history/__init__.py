"""The commands of `rig history`, and what other commands ask of a history or enter into it."""
