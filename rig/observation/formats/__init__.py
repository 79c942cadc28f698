"""File formats of others, read into columns of numbers: CSV, ROS 2 bags, PX4's logs."""
