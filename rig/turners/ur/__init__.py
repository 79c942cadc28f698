"""An arm of Universal Robots: the real `ur_rtde` client in a supervised child process, pre-flight, the stop."""
