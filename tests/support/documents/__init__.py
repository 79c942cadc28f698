"""Results and certificates: made, signed and forged."""
