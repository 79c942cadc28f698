"""Commands about what a finished run leaves: show, report, export, verify, explain."""
