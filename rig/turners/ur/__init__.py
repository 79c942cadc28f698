"""An arm of Universal Robots: the `ur_rtde` client in a supervised child process, pre-flight, and the stop."""
