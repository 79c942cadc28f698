"""Signatures on certificates: made with the laboratory's key, verified by anyone."""
