"""File formats of other programs, read into columns of numbers: CSV, MATLAB, ROS bags, PX4's logs."""
