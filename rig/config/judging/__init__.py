"""Sections about judging and storing a result: limits, site, certificate, history, series of parts."""
