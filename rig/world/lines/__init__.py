"""The simulated device that prints its samples as lines, on a serial line of its own."""
