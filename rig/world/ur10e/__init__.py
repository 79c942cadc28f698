"""The simulated controller of a Universal Robots arm: its joints, its programs, its servers."""
