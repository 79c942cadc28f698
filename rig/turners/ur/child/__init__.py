"""The supervised process in which the `ur_rtde` client lives, and the program's end of it."""
