"""The emulated board as the laboratory mounts it, its memory and its serial line."""
