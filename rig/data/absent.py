"""What stands for an arm or a board in the results of measurements that had none."""

NO_BOARD = "none"  # where every sensor has a port of its own
NO_ARM = "none"  # of readings recorded elsewhere
