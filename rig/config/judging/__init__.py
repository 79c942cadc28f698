"""Sections about judging a result and keeping it: limits, site, certificate, history, series of parts."""
