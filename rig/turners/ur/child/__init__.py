"""The supervised process of the `ur_rtde` client, and the parent's end of the link to it."""
