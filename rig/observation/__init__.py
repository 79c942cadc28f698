"""From a recording to averaged observations: time base, revolutions, rests. Pure functions."""
