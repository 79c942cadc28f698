"""The controller's interfaces as the rig uses them: RTDE, dashboard, primary, Robot API."""
