"""IMUs of autopilots, ArduPilot and PX4, by MAVLink over a port of their own, with onboard corrections undone."""
