"""Commands about one device: board, KVH 1775, autopilot, a device that sends lines of text."""
