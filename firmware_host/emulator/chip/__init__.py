"""The chip's peripherals: clocks, timers, buses, flash."""
