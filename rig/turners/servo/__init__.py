"""The Dynamixel X servo as a turner: one shaft, driven through the maker's `dynamixel-sdk`."""
