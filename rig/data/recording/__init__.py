"""The run file: its layout, its events, its settings, and its descriptions of sensors and turners."""
