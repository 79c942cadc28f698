"""The history of a laboratory: all finished runs, each sensor over time, and the rig itself."""
