"""The board: its firmware, the link to it, and its emulator."""
