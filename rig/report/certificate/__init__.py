"""The calibration certificate: what ISO/IEC 17025, 7.8, asks for, said by a result and by the laboratory."""
