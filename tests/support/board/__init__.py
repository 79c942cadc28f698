"""The firmware on this machine and on the emulated chip, with its surroundings."""
