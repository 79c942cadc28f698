"""Output of commands for people: results, plans, devices."""
