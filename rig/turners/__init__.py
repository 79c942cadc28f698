"""Who turns the sensors: the drivers of what moves, each in a room that knows its maker's protocol."""
