"""The simulated autopilot: parameters, corrections, filters and messages of ArduPilot or PX4, on its own line."""
