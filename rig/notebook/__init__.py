"""The rig in a notebook: recordings and results as objects that display themselves."""
