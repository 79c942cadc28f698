"""Scale and bias as functions of temperature and of time."""
