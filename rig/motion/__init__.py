"""What is turned and how, whoever turns it: joints, geometry, steps, limits, and what keeps clear of what."""
