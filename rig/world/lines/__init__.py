"""The simulated device that sends its samples as lines of text, on its own serial line."""
