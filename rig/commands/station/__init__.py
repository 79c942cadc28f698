"""Commands for series and for onlookers: station, floor, watch."""
