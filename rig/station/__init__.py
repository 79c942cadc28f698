"""Whoever stands at the rig: what the operator sees and is asked."""
