"""Every way to stop the arm, and the trial of them before anything moves."""
