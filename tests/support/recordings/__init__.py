"""Recordings: computed, drawn, damaged and frozen, and their solution."""
