"""Signatures on certificates: made by the laboratory's key, and looked at by anybody."""
