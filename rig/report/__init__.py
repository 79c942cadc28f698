"""What a run leaves behind: result, certificate, C header, tables."""
