"""The emulated board as the simulated laboratory mounts it: sensors, memory and serial line."""
