"""The shared parts of the tests: simulated worlds, drivers and boards, synthetic recordings, paths."""
