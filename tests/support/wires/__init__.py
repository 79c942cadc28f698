"""What stands at the other end of a wire or in it: devices, relays, damage."""
