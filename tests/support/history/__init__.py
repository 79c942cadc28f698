"""Histories, their databases and their users."""
