"""Interfaces of kinds of results to every outlet, and the characteristics that entries state."""
