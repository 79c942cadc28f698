"""Commands about a finished run: show, report, export, verify, explain."""
