"""The emulated board as the laboratory mounts it: sensors, memory and serial line."""
