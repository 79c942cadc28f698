"""What commands print for people: results, plans, devices."""
