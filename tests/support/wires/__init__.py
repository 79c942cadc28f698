"""Devices at the other end of a wire, relays, and damage to its bytes."""
