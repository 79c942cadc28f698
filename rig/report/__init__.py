"""What a run leaves behind: result, C header, tables."""
