"""A driver for a calibration rig: a robot arm turns a board of inertial sensors and solves for their calibration."""

__version__ = "0.1.0"
