"""IMUs of autopilots, ArduPilot and PX4, by MAVLink over a port of their own: what is corrected there is undone."""
