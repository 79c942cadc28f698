"""Files as other programs and people write them, valid and hostile."""
