"""Histories, their databases and those who use them."""
