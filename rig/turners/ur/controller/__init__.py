"""The controller's interfaces in use: RTDE, dashboard, primary interface, Robot API."""
