"""Recordings made elsewhere: from columns of samples, sweeps and attitudes to observations."""
