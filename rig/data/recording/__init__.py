"""The run file: its layout, its events, its settings, the sensors and turners that it describes."""
