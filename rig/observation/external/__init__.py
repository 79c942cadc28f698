"""External recordings: from columns of samples, sweeps and attitudes to observations."""
