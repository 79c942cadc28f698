"""The simulated controller of an arm of Universal Robots: its joints, its programs, its servers."""
