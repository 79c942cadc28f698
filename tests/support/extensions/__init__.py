"""What somebody's own packages add: a kind of sensor, a turner."""
