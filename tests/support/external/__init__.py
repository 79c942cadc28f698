"""Files as other programs and other people write them, sound and hostile."""
