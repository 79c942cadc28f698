"""The documents of a run: result, certificate, C header, tables."""
