"""A history in words and tables for a terminal."""
