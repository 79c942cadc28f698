"""The calibration certificate: the content of ISO/IEC 17025, 7.8, from a result and the laboratory's statements."""
