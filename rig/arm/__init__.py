"""The arm: the real `ur_rtde` client in a supervised child process, kinematics, sweep planning, pre-flight."""
