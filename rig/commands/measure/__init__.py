"""Commands about one run on a rig: plan, check, run, resume, record."""
