"""All paths of a stop, and the trial of the stop before anything moves."""
