"""The arm: the real `ur_rtde` client in a supervised child process, kinematics, pre-flight, the stop."""
