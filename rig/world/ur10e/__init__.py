"""The simulated UR10e controller: its joints, its programs, its servers."""
