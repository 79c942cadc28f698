"""The simulated device that prints its samples as lines of text, on its own serial line."""
