"""Files of configurations and of this user's own: read and written safely, layer by layer."""
