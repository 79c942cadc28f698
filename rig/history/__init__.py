"""The laboratory's memory: all finished runs, each sensor over time, and the rig itself."""
