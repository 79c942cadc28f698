"""The firmware on this machine and on the emulated chip, and what surrounds it."""
