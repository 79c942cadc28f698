"""Any device that prints its samples as lines of text, on a serial port of its own."""
