"""Recordings: computed, drawn, damaged and frozen, and how they are solved."""
