"""The simulated controller's interfaces: RTDE, dashboard, primary, scripts, Robot API."""
